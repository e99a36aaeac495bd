//! Conversions from and to NumPy arrays, and from JSON.

use glimpse_core::geometry::Angles;
use glimpse_fitting::measurement::angles_from_vectors;
use numpy::ndarray::{ArrayD, IxDyn};
use numpy::{PyArrayDyn, PyReadonlyArrayDyn};
use pyo3::prelude::*;
use pyo3::types::IntoPyDict;
use serde_json::Value;

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
        let array = match outgoing {
            Some(outgoing) => numbers(&stack_pairs(incoming, outgoing)?, "directions")?,
            None => numbers(incoming, "directions")?,
        };
        let [shape @ .., 2, 3] = array.shape() else {
            return reject(format!(
                "directions must have the shape (..., 2, 3), incoming and outgoing unit vectors, not {}; \
                 or pass both as two arrays (..., 3)",
                shape_text(array.shape())
            ));
        };
        let vectors = normalize(triples(&array))?;
        Ok(Self {
            pairs: vectors.as_chunks().0.to_vec(),
            shape: shape.to_vec(),
        })
    }

    /// The angles of each pair, which must be above the horizon.
    pub(crate) fn angles(&self) -> PyResult<Vec<Angles<f32>>> {
        let each = self.pairs.iter().enumerate();
        let angles = each.map(|(row, [incoming, outgoing])| {
            angles_from_vectors(*incoming, *outgoing).ok_or_else(|| {
                GlimpseError::new_err(format!(
                    "a direction of pair {row} is not above the horizon"
                ))
            })
        });
        angles.collect()
    }
}

/// Broadcasts two arrays (..., 3) and stacks them to (..., 2, 3).
fn stack_pairs<'py>(
    incoming: &Bound<'py, PyAny>,
    outgoing: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    for (argument, name) in [(incoming, "incoming"), (outgoing, "outgoing")] {
        let array = numbers(argument, name)?;
        if array.shape().last() != Some(&3) {
            return reject(format!(
                "{name} must have the shape (..., 3), not {}",
                shape_text(array.shape())
            ));
        }
    }
    let numpy = incoming.py().import("numpy")?;
    let arrays = numpy.call_method1("broadcast_arrays", (incoming, outgoing));
    let arrays = arrays.map_err(|error| {
        GlimpseError::new_err(format!(
            "incoming and outgoing cannot be broadcast: make their shapes equal ({error})"
        ))
    })?;
    numpy.call_method1("stack", (arrays, -2))
}

/// Scales vectors to length 1.
fn normalize(vectors: Vec<[f64; 3]>) -> PyResult<Vec<[f64; 3]>> {
    let normalized = vectors.into_iter().enumerate().map(|(index, vector)| {
        let [x, y, z] = vector;
        let length = x.hypot(y).hypot(z);
        match length.is_finite() && length > 0.0 {
            true => Ok(vector.map(|entry| entry / length)),
            false => reject(format!(
                "the {} vector of pair {} is ({x}, {y}, {z}), which has no direction; pass finite, nonzero vectors",
                ["incoming", "outgoing"][index % 2],
                index / 2
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

/// Converts JSON to dicts, lists, strings and numbers.
pub(crate) fn to_python<'py>(
    py: Python<'py>,
    value: impl Into<Value>,
) -> PyResult<Bound<'py, PyAny>> {
    let text = value.into().to_string();
    py.import("json")?.call_method1("loads", (text,))
}

/// Converts Python's numbers, text, lists and arrays to JSON.
pub(crate) fn from_python(value: &Bound<'_, PyAny>) -> PyResult<Value> {
    let py = value.py();
    // NumPy's numbers and arrays have this method.
    let to_list = py
        .import("operator")?
        .call_method1("methodcaller", ("tolist",))?;
    let options = [("default", to_list)].into_py_dict(py)?;
    let text = py
        .import("json")?
        .call_method("dumps", (value,), Some(&options))?;
    let value = serde_json::from_str(&text.extract::<String>()?);
    value.map_err(|error| GlimpseError::new_err(error.to_string()))
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
