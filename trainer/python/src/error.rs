//! Errors as Python exceptions, with the trainer's messages.

use std::error::Error;
use std::ffi::CString;
use std::io;

use glimpse_materials::SourceError;
use pyo3::exceptions::{PyRuntimeError, PyUserWarning, PyValueError};
use pyo3::prelude::*;

pyo3::create_exception!(
    glimpse_brdf,
    GlimpseError,
    PyValueError,
    "Invalid input, or a failed computation. The message states the problem and its remedy."
);

pyo3::create_exception!(
    glimpse_brdf,
    ImplausibleError,
    GlimpseError,
    "Readings that are unlikely to come from a material. The attribute `fit` is the FittedMaterial."
);

/// The result of a function that Python calls.
pub(crate) type Result<T> = std::result::Result<T, Failure>;

/// Any error: `?` converts the library's errors to exceptions.
pub(crate) struct Failure(PyErr);

impl<E: Error + Send + Sync + 'static> From<E> for Failure {
    fn from(error: E) -> Self {
        let error: Box<dyn Error + Send + Sync> = Box::new(error);
        let exception = error.downcast::<PyErr>();
        Self(exception.map_or_else(|error| to_exception(&*error), |exception| *exception))
    }
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        failure.0
    }
}

/// Converts a library error to an exception: `FileNotFoundError` for a missing file, `PermissionError` for a file
/// that cannot be opened, and `GlimpseError` otherwise.
fn to_exception(error: &(dyn Error + 'static)) -> PyErr {
    let (mut cause, mut kind) = (Some(error), None);
    if matches!(error.downcast_ref(), Some(SourceError::NotFound(_))) {
        kind = Some(io::ErrorKind::NotFound);
    }
    while let Some(error) = cause {
        kind = kind.or_else(|| Some(error.downcast_ref::<io::Error>()?.kind()));
        cause = error.source();
    }
    match kind {
        Some(kind @ (io::ErrorKind::NotFound | io::ErrorKind::PermissionDenied)) => {
            io::Error::new(kind, error.to_string()).into()
        }
        _ => GlimpseError::new_err(error.to_string()),
    }
}

/// Warns the user.
pub(crate) fn warn(py: Python<'_>, text: String) -> Result<()> {
    let (category, text) = (py.get_type::<PyUserWarning>(), CString::new(text)?);
    Ok(PyErr::warn(py, &category, &text, 1)?)
}

/// Returns a `GlimpseError` with this message.
pub(crate) fn reject<T>(message: impl Into<String>) -> Result<T> {
    Err(Failure(GlimpseError::new_err(message.into())))
}

/// Converts a panic to an exception, so that it does not abort the interpreter. A panic is a bug in this module.
pub(crate) fn panic_exception(payload: &(dyn std::any::Any + Send)) -> PyErr {
    let text = payload.downcast_ref::<String>().map(String::as_str);
    let text = text.or_else(|| payload.downcast_ref::<&str>().copied());
    PyRuntimeError::new_err(format!(
        "a bug in glimpse_brdf, please report it: {}",
        text.unwrap_or("unknown panic")
    ))
}
