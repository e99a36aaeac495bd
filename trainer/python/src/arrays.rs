//! Conversions from and to NumPy arrays.

use numpy::ndarray::{ArrayD, IxDyn};
use numpy::{PyArrayDyn, PyReadonlyArrayDyn};
use pyo3::prelude::*;

use crate::error::{GlimpseError, reject};

/// Converts an array of any real type and layout to f64. `name` is the argument's name for error messages.
pub(crate) fn numbers(argument: &Bound<'_, PyAny>, name: &str) -> PyResult<ArrayD<f64>> {
    let py = argument.py();
    let invalid = |reason: String| {
        GlimpseError::new_err(format!("{name} must be an array of numbers: {reason}"))
    };
    let numpy = py.import("numpy")?;
    let array = numpy
        .call_method1("asarray", (argument,))
        .map_err(|error| invalid(error.to_string()))?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    if !"fiub".contains(&kind) {
        let dtype = array.getattr("dtype")?.str()?.to_string();
        return Err(invalid(format!(
            "its dtype is {dtype}; convert it to floats"
        )));
    }
    let array = array.call_method1("astype", ("float64",))?;
    let array: PyReadonlyArrayDyn<'_, f64> = array
        .extract()
        .map_err(|_| invalid("NumPy did not return an array".to_owned()))?;
    Ok(array.as_array().to_owned())
}

/// Converts an array of shape (n, 3) to rows.
pub(crate) fn rows(argument: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<[f64; 3]>> {
    let array = numbers(argument, name)?;
    match array.shape() {
        [_, 3] => Ok(triples(&array)),
        shape => reject(format!(
            "{name} must have the shape (n, 3), not {}",
            shape_text(shape)
        )),
    }
}

/// Splits an array whose last axis has length 3 into vectors.
fn triples(array: &ArrayD<f64>) -> Vec<[f64; 3]> {
    let flat: Vec<f64> = array.iter().copied().collect();
    flat.as_chunks().0.to_vec()
}

/// Pairs of directions, and the leading axes of their array: its shape without the axes of pairs and coordinates.
pub(crate) struct Pairs {
    pub(crate) pairs: Vec<[[f64; 3]; 2]>,
    pub(crate) shape: Vec<usize>,
}

impl Pairs {
    /// Reads pairs from `incoming` of shape (..., 2, 3), or from two arrays (..., 3) that are broadcast.
    /// Each vector is normalized.
    pub(crate) fn from_arrays(
        incoming: &Bound<'_, PyAny>,
        outgoing: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let Some(outgoing) = outgoing else {
            let array = numbers(incoming, "directions")?;
            let [shape @ .., 2, 3] = array.shape() else {
                return reject(format!(
                    "directions must have the shape (..., 2, 3), incoming and outgoing unit vectors, not {}; \
                     or pass both as two arrays (..., 3)",
                    shape_text(array.shape())
                ));
            };
            let vectors = normalize(triples(&array), "directions")?;
            return Ok(Self {
                pairs: vectors.as_chunks().0.to_vec(),
                shape: shape.to_vec(),
            });
        };
        let arrays = [(incoming, "incoming"), (outgoing, "outgoing")].map(|(argument, name)| {
            let array = numbers(argument, name)?;
            match array.shape() {
                [.., 3] => Ok(array),
                shape => reject(format!(
                    "{name} must have the shape (..., 3), not {}",
                    shape_text(shape)
                )),
            }
        });
        let [incoming, outgoing] = arrays;
        let (incoming, outgoing) = (incoming?, outgoing?);
        let Some(shape) = broadcast(incoming.shape(), outgoing.shape()) else {
            return reject(format!(
                "incoming of shape {} and outgoing of shape {} cannot be broadcast: make their shapes equal",
                shape_text(incoming.shape()),
                shape_text(outgoing.shape())
            ));
        };
        let expand = |array: ArrayD<f64>, name| {
            let array = array.broadcast(IxDyn(&shape)).map(|array| array.to_owned());
            normalize(array.as_ref().map(triples).unwrap_or_default(), name)
        };
        let (incoming, outgoing) = (expand(incoming, "incoming")?, expand(outgoing, "outgoing")?);
        let pairs = incoming.into_iter().zip(outgoing);
        Ok(Self {
            pairs: pairs
                .map(|(incoming, outgoing)| [incoming, outgoing])
                .collect(),
            shape: shape[..shape.len() - 1].to_vec(),
        })
    }
}

/// Broadcasts two shapes by NumPy's rule: aligned at the last axis, lengths are equal or one of them is 1.
fn broadcast(first: &[usize], second: &[usize]) -> Option<Vec<usize>> {
    let axes = first.len().max(second.len());
    let length = |shape: &[usize], axis: usize| match (axis + shape.len()).checked_sub(axes) {
        Some(index) => shape[index],
        None => 1,
    };
    (0..axes)
        .map(|axis| match (length(first, axis), length(second, axis)) {
            (a, b) if a == b => Some(a),
            (1, b) => Some(b),
            (a, 1) => Some(a),
            _ => None,
        })
        .collect()
}

/// Scales vectors to length 1.
fn normalize(vectors: Vec<[f64; 3]>, name: &str) -> PyResult<Vec<[f64; 3]>> {
    let normalized = vectors.into_iter().enumerate().map(|(index, vector)| {
        let [x, y, z] = vector;
        let length = x.hypot(y).hypot(z);
        match length.is_finite() && length > 0.0 {
            true => Ok(vector.map(|entry| entry / length)),
            false => reject(format!(
                "{name}: vector {index} is ({x}, {y}, {z}), which has no direction; pass finite, nonzero vectors"
            )),
        }
    });
    normalized.collect()
}

/// Formats a shape as Python does.
pub(crate) fn shape_text(shape: &[usize]) -> String {
    match shape {
        [length] => format!("({length},)"),
        lengths => format!(
            "({})",
            lengths
                .iter()
                .map(usize::to_string)
                .collect::<Vec<_>>()
                .join(", ")
        ),
    }
}

/// Returns an array with the given shape and entries.
pub(crate) fn array<'py, T: numpy::Element>(
    py: Python<'py>,
    shape: &[usize],
    numbers: Vec<T>,
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    let array = ArrayD::from_shape_vec(IxDyn(shape), numbers);
    let array = array.map_err(|error| GlimpseError::new_err(error.to_string()))?;
    Ok(PyArrayDyn::from_owned_array(py, array))
}
