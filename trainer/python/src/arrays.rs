//! Conversions from and to NumPy arrays, and from JSON.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_fitting::measurement::angles_from_vectors;
use numpy::ndarray::ArrayD;
use numpy::{PyArrayDyn, PyReadonlyArrayDyn};
use pyo3::prelude::*;
use pyo3::types::IntoPyDict;
use serde::Serialize;
use serde_json::Value;

use crate::error::{Failure, Result, reject};

/// Converts an array of any real type and layout to f64. `name` is the argument's name for error messages.
pub(crate) fn numbers(argument: &Bound<'_, PyAny>, name: &str) -> Result<ArrayD<f64>> {
    let invalid = |reason: String| format!("{name} must be an array of numbers: {reason}");
    let numpy = argument.py().import("numpy")?;
    let array = match numpy.call_method1("asarray", (argument,)) {
        Ok(array) => array,
        Err(error) => return reject(invalid(error.to_string())),
    };
    let dtype = array.getattr("dtype")?;
    if !"fiub".contains(&dtype.getattr("kind")?.extract::<String>()?) {
        return reject(invalid(format!(
            "its dtype is {dtype}; convert it to floats"
        )));
    }
    let array = array.call_method1("astype", ("float64",))?;
    let array: PyReadonlyArrayDyn<'_, f64> = array.extract()?;
    Ok(array.as_array().to_owned())
}

/// Converts an array of shape (n, 3) to rows.
pub(crate) fn rows(argument: &Bound<'_, PyAny>, name: &str) -> Result<Vec<[f64; 3]>> {
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
    ) -> Result<Self> {
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
    pub(crate) fn angles(&self) -> Result<Vec<Angles<f32>>> {
        let pairs = (0..).zip(&self.pairs);
        let angles = pairs.map(|(row, [incoming, outgoing])| {
            angles_from_vectors(*incoming, *outgoing).map_or_else(
                || {
                    reject(format!(
                        "a direction of pair {row} is not above the horizon"
                    ))
                },
                Ok,
            )
        });
        angles.collect()
    }
}

/// Broadcasts two arrays (..., 3) and stacks them to (..., 2, 3).
fn stack_pairs<'py>(
    incoming: &Bound<'py, PyAny>,
    outgoing: &Bound<'py, PyAny>,
) -> Result<Bound<'py, PyAny>> {
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
    match numpy.call_method1("broadcast_arrays", (incoming, outgoing)) {
        Ok(arrays) => Ok(numpy.call_method1("stack", (arrays, -2))?),
        Err(error) => reject(format!(
            "incoming and outgoing cannot be broadcast: make their shapes equal ({error})"
        )),
    }
}

/// Scales vectors to length 1.
fn normalize(vectors: Vec<[f64; 3]>) -> Result<Vec<[f64; 3]>> {
    let normalized = vectors.into_iter().enumerate().map(|(index, vector)| {
        let [x, y, z] = vector;
        let length = x.hypot(y).hypot(z);
        if length.is_finite() && length > 0.0 {
            return Ok(vector.map(|entry| entry / length));
        }
        reject(format!(
            "the {} vector of pair {} is ({x}, {y}, {z}), which has no direction; pass finite, nonzero vectors",
            ["incoming", "outgoing"][index % 2],
            index / 2
        ))
    });
    normalized.collect()
}

/// Formats a shape as Python does.
pub(crate) fn shape_text(shape: &[usize]) -> String {
    match shape {
        [length] => format!("({length},)"),
        lengths => format!("{lengths:?}").replace('[', "(").replace(']', ")"),
    }
}

/// Converts a value to dicts, lists, strings and numbers.
pub(crate) fn to_python(py: Python<'_>, value: impl Serialize) -> Result<Bound<'_, PyAny>> {
    let text = serde_json::to_string(&value)?;
    Ok(py.import("json")?.call_method1("loads", (text,))?)
}

/// Converts Python's numbers, text, lists and arrays to JSON.
pub(crate) fn from_python(value: &Bound<'_, PyAny>) -> Result<Value> {
    let py = value.py();
    // NumPy's numbers and arrays have this method.
    let to_list = py
        .import("operator")?
        .call_method1("methodcaller", ("tolist",))?;
    let options = [("default", to_list)].into_py_dict(py)?;
    let text = py
        .import("json")?
        .call_method("dumps", (value,), Some(&options))?;
    Ok(serde_json::from_str(&text.extract::<String>()?)?)
}

/// Returns the incoming and outgoing unit vectors of angles.
pub(crate) fn directions_of(angles: Angles<f32>) -> [[f64; 3]; 2] {
    let pair = HalfDifference::from_angles(angles.map(f64::from)).directions();
    [pair.incoming, pair.outgoing]
}

/// An array that is returned to Python: its shape and entries.
pub(crate) struct Array<T>(Vec<usize>, Vec<T>);

impl<T> Array<T> {
    /// Creates an array with the given leading axes. The last axis has a given length.
    pub(crate) fn new(leading: &[usize], last: usize, entries: Vec<T>) -> Self {
        Self([leading, &[last]].concat(), entries)
    }

    /// Creates an array of shape (n,).
    pub(crate) fn list(entries: impl IntoIterator<Item = T>) -> Self {
        let entries = Vec::from_iter(entries);
        Self(vec![entries.len()], entries)
    }

    /// Creates an array of shape (n, columns).
    pub(crate) fn rows<const N: usize>(rows: impl IntoIterator<Item = [T; N]>) -> Self {
        let entries: Vec<T> = rows.into_iter().flatten().collect();
        Self(vec![entries.len() / N, N], entries)
    }
}

impl Array<f64> {
    /// Creates an array of shape (n, 2, 3): incoming and outgoing unit vectors.
    pub(crate) fn pairs(pairs: impl IntoIterator<Item = [[f64; 3]; 2]>) -> Self {
        let pairs = Vec::from_iter(pairs);
        Self(vec![pairs.len(), 2, 3], pairs.concat().concat())
    }

    /// Creates an array of shape (n, 2, 3) of the directions of angles.
    pub(crate) fn directions(angles: impl IntoIterator<Item = Angles<f32>>) -> Self {
        Self::pairs(angles.into_iter().map(directions_of))
    }
}

impl<'py, T: numpy::Element> IntoPyObject<'py> for Array<T> {
    type Target = PyArrayDyn<T>;
    type Output = Bound<'py, PyArrayDyn<T>>;
    type Error = PyErr;

    fn into_pyobject(self, py: Python<'py>) -> PyResult<Self::Output> {
        let array = ArrayD::from_shape_vec(self.0, self.1).map_err(Failure::from)?;
        Ok(PyArrayDyn::from_owned_array(py, array))
    }
}
