//! NumPy's arrays in and out.

use numpy::ndarray::{ArrayD, IxDyn};
use numpy::{PyArrayDyn, PyReadonlyArrayDyn};
use pyo3::prelude::*;

use crate::error::{GlimpseError, refused};

/// Numbers of whatever type and layout, as f64; `what` they are is said if they are none.
pub(crate) fn numbers(given: &Bound<'_, PyAny>, what: &str) -> PyResult<ArrayD<f64>> {
    let py = given.py();
    let none =
        |why: String| GlimpseError::new_err(format!("{what} should be an array of numbers: {why}"));
    let numpy = py.import("numpy")?;
    let array = numpy
        .call_method1("asarray", (given,))
        .map_err(|error| none(error.to_string()))?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    if !"fiub".contains(&kind) {
        let dtype = array.getattr("dtype")?.str()?.to_string();
        return Err(none(format!("its dtype is {dtype}; give floats")));
    }
    let array = array.call_method1("astype", ("float64",))?;
    let array: PyReadonlyArrayDyn<'_, f64> =
        array.extract().map_err(|_| none("it is none".to_owned()))?;
    Ok(array.as_array().to_owned())
}

/// Rows of three numbers, of shape (n, 3).
pub(crate) fn rows(given: &Bound<'_, PyAny>, what: &str) -> PyResult<Vec<[f64; 3]>> {
    let array = numbers(given, what)?;
    match array.shape() {
        [_, 3] => Ok(triples(&array)),
        shape => refused(format!(
            "{what} should have the shape (n, 3), not {}",
            shown(shape)
        )),
    }
}

/// The last axis, whose length is 3, number by number.
fn triples(array: &ArrayD<f64>) -> Vec<[f64; 3]> {
    let flat: Vec<f64> = array.iter().copied().collect();
    flat.as_chunks().0.to_vec()
}

/// Pairs of directions, and the shape of the array that they came in, without its axes of pairs and
/// coordinates.
pub(crate) struct Pairs {
    pub(crate) pairs: Vec<[[f64; 3]; 2]>,
    pub(crate) shape: Vec<usize>,
}

impl Pairs {
    /// Of `incoming` of shape (..., 2, 3), or of two arrays (..., 3) that are broadcast. Each is brought to
    /// length 1.
    pub(crate) fn of(
        incoming: &Bound<'_, PyAny>,
        outgoing: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let Some(outgoing) = outgoing else {
            let array = numbers(incoming, "directions")?;
            let [shape @ .., 2, 3] = array.shape() else {
                return refused(format!(
                    "directions should have the shape (..., 2, 3), incoming and outgoing unit vectors, not {}; \
                     or give both as two arrays (..., 3)",
                    shown(array.shape())
                ));
            };
            let triples = unit(triples(&array), "directions")?;
            return Ok(Self {
                pairs: triples.as_chunks().0.to_vec(),
                shape: shape.to_vec(),
            });
        };
        let both = [(incoming, "incoming"), (outgoing, "outgoing")].map(|(given, what)| {
            let array = numbers(given, what)?;
            match array.shape() {
                [.., 3] => Ok(array),
                shape => refused(format!(
                    "{what} should have the shape (..., 3), not {}",
                    shown(shape)
                )),
            }
        });
        let [incoming, outgoing] = both;
        let (incoming, outgoing) = (incoming?, outgoing?);
        let Some(shape) = broadcast(incoming.shape(), outgoing.shape()) else {
            return refused(format!(
                "incoming of the shape {} and outgoing of {} do not go together",
                shown(incoming.shape()),
                shown(outgoing.shape())
            ));
        };
        let spread = |array: ArrayD<f64>, what| {
            let array = array.broadcast(IxDyn(&shape)).map(|array| array.to_owned());
            unit(array.as_ref().map(triples).unwrap_or_default(), what)
        };
        let (incoming, outgoing) = (spread(incoming, "incoming")?, spread(outgoing, "outgoing")?);
        let pairs = incoming.into_iter().zip(outgoing);
        Ok(Self {
            pairs: pairs
                .map(|(incoming, outgoing)| [incoming, outgoing])
                .collect(),
            shape: shape[..shape.len() - 1].to_vec(),
        })
    }
}

/// NumPy's rule: from the last axis on, lengths are the same or one of them is 1.
fn broadcast(one: &[usize], other: &[usize]) -> Option<Vec<usize>> {
    let axes = one.len().max(other.len());
    let length = |shape: &[usize], axis: usize| match (axis + shape.len()).checked_sub(axes) {
        Some(place) => shape[place],
        None => 1,
    };
    (0..axes)
        .map(|axis| match (length(one, axis), length(other, axis)) {
            (a, b) if a == b => Some(a),
            (1, b) => Some(b),
            (a, 1) => Some(a),
            _ => None,
        })
        .collect()
}

/// Brought to length 1.
fn unit(vectors: Vec<[f64; 3]>, what: &str) -> PyResult<Vec<[f64; 3]>> {
    let each = vectors.into_iter().enumerate().map(|(index, vector)| {
        let [x, y, z] = vector;
        let length = x.hypot(y).hypot(z);
        match length.is_finite() && length > 0.0 {
            true => Ok(vector.map(|entry| entry / length)),
            false => refused(format!(
                "{what}: vector {index} is ({x}, {y}, {z}), which is no direction; give finite vectors that \
                 are not 0"
            )),
        }
    });
    each.collect()
}

/// A shape as Python shows it.
pub(crate) fn shown(shape: &[usize]) -> String {
    match shape {
        [one] => format!("({one},)"),
        more => format!(
            "({})",
            more.iter()
                .map(usize::to_string)
                .collect::<Vec<_>>()
                .join(", ")
        ),
    }
}

/// An array of a shape, of so many numbers.
pub(crate) fn array<'py, T: numpy::Element>(
    py: Python<'py>,
    shape: &[usize],
    numbers: Vec<T>,
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    let array = ArrayD::from_shape_vec(IxDyn(shape), numbers);
    let array = array.map_err(|error| GlimpseError::new_err(error.to_string()))?;
    Ok(PyArrayDyn::from_owned_array(py, array))
}
