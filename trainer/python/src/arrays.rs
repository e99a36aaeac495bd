//! Conversions from and to NumPy arrays, and from JSON.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_fitting::measurement::angles_from_vectors;
use numpy::ndarray::ArrayD;
use numpy::{PyArrayDyn, PyReadonlyArrayDyn};
use pyo3::call::PyCallArgs;
use pyo3::prelude::*;
use serde::Serialize;
use serde_json::Value;

use crate::error::{Failure, Result, reject};

/// Calls a function of the Python module `_arrays`, which returns an array.
fn call<'py>(
    py: Python<'py>,
    function: &str,
    arguments: impl PyCallArgs<'py>,
) -> Result<ArrayD<f64>> {
    let module = py.import("glimpse_brdf._arrays")?;
    let array = module.call_method1(function, arguments)?;
    let array: PyReadonlyArrayDyn<'_, f64> = array.extract()?;
    Ok(array.as_array().to_owned())
}

/// Creates an object of a class of the Python module `_results`.
pub(crate) fn result<'py>(
    py: Python<'py>,
    class: &str,
    arguments: impl PyCallArgs<'py>,
) -> Result<Bound<'py, PyAny>> {
    let module = py.import("glimpse_brdf._results")?;
    Ok(module.call_method1(class, arguments)?)
}

/// Converts an array of any real type and layout to f64. `name` is the argument's name for error messages.
pub(crate) fn numbers(argument: &Bound<'_, PyAny>, name: &str) -> Result<ArrayD<f64>> {
    call(argument.py(), "numbers", (argument, name))
}

/// Converts an array of `count` rows, or of any number of rows. `hint` follows the shape in the error message.
pub(crate) fn rows(
    argument: &Bound<'_, PyAny>,
    name: &str,
    (count, columns): (Option<usize>, usize),
    hint: &str,
) -> Result<ArrayD<f64>> {
    let arguments = (argument, name, count, columns, hint);
    call(argument.py(), "rows", arguments)
}

/// Converts an array of shape (n, 3), or (count, 3), to colors.
pub(crate) fn colors(
    argument: &Bound<'_, PyAny>,
    name: &str,
    count: Option<usize>,
) -> Result<Vec<[f32; 3]>> {
    let array = rows(argument, name, (count, 3), "")?;
    let values: Vec<f32> = array.iter().map(|value| *value as f32).collect();
    Ok(values.as_chunks().0.to_vec())
}

/// Reads one number for all channels, or one for each.
pub(crate) fn channels(argument: &Bound<'_, PyAny>, name: &str) -> Result<[f32; 3]> {
    let array = call(argument.py(), "channels", (argument, name))?;
    Ok([0, 1, 2].map(|channel| array[[channel]] as f32))
}

/// Pairs of directions, and the leading axes of their array: its shape without the axes of pairs and coordinates.
pub(crate) struct Pairs {
    pub(crate) pairs: Vec<[[f64; 3]; 2]>,
    pub(crate) shape: Vec<usize>,
}

impl Pairs {
    /// Reads pairs from `incoming` of shape (..., 2, 3), or from two arrays (..., 3) that are broadcast.
    /// Each vector is normalized. The pairs for which `free` is true may be NaN, of no direction.
    pub(crate) fn from_arrays(
        incoming: &Bound<'_, PyAny>,
        outgoing: Option<&Bound<'_, PyAny>>,
        free: &[bool],
    ) -> Result<Self> {
        let array = call(incoming.py(), "pairs", (incoming, outgoing, free.to_vec()))?;
        let flat: Vec<f64> = array.iter().copied().collect();
        Ok(Self {
            pairs: flat.as_chunks().0.as_chunks().0.to_vec(),
            shape: array.shape()[..array.ndim() - 2].to_vec(),
        })
    }

    /// The angles of each pair, which must be above the horizon.
    pub(crate) fn angles(&self) -> Result<Vec<Angles<f32>>> {
        let angles = (0..).zip(&self.pairs).map(|(row, pair)| {
            let [incoming, outgoing] = *pair;
            let below = || format!("a direction of pair {row} is not above the horizon");
            angles_from_vectors(incoming, outgoing).map_or_else(|| reject(below()), Ok)
        });
        angles.collect()
    }
}

/// Converts a value to dicts, lists, strings and numbers.
pub(crate) fn to_python(py: Python<'_>, value: impl Serialize) -> Result<Bound<'_, PyAny>> {
    let text = serde_json::to_string(&value)?;
    Ok(py.import("json")?.call_method1("loads", (text,))?)
}

/// Converts Python's numbers, text, lists and arrays to JSON.
pub(crate) fn from_python(value: &Bound<'_, PyAny>) -> Result<Value> {
    let module = value.py().import("glimpse_brdf._arrays")?;
    let text: String = module.call_method1("to_json", (value,))?.extract()?;
    Ok(serde_json::from_str(&text)?)
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
