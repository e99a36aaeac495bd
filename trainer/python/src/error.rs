//! Errors as Python exceptions, with the trainer's messages.

use std::error::Error;
use std::io;

use glimpse_evaluation::conversion::ConversionError;
use glimpse_evaluation::evaluation::EvaluationError;
use glimpse_fitting::measurement::FitFailure;
use glimpse_materials::setting::{Setting, SettingError};
use glimpse_materials::{ShareError, SourceError};
use glimpse_training::meta::options::OptionsError;
use glimpse_training::meta::run::TrainError;
use glimpse_training::route::PlanError;
use pyo3::exceptions::{PyFileNotFoundError, PyPermissionError, PyRuntimeError, PyValueError};
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

/// Converts a library error to an exception: `FileNotFoundError` for a missing file, `PermissionError` for a file
/// that cannot be opened, and `GlimpseError` otherwise.
pub(crate) fn to_exception(error: impl Error + 'static) -> PyErr {
    let error: &(dyn Error + 'static) = &error;
    let text = message(error);
    if matches!(error.downcast_ref(), Some(SourceError::NotFound(_))) {
        return PyFileNotFoundError::new_err(text);
    }
    let (mut cause, mut kind) = (Some(error), None);
    while let Some(error) = cause {
        kind = kind.or_else(|| Some(error.downcast_ref::<io::Error>()?.kind()));
        cause = error.source();
    }
    match kind {
        Some(io::ErrorKind::NotFound) => PyFileNotFoundError::new_err(text),
        Some(io::ErrorKind::PermissionDenied) => PyPermissionError::new_err(text),
        _ => GlimpseError::new_err(text),
    }
}

/// Returns the message of an error. It refers to settings by the names of Python's parameters.
fn message(error: &(dyn Error + 'static)) -> String {
    fn with_parameters<E: SettingError + Error + 'static>(
        error: &(dyn Error + 'static),
    ) -> Option<String> {
        Some(error.downcast_ref::<E>()?.message(parameter))
    }
    if let Some(TrainError::Options(error)) = error.downcast_ref() {
        return error.message(parameter);
    }
    with_parameters::<EvaluationError>(error)
        .or_else(|| with_parameters::<ShareError>(error))
        .or_else(|| with_parameters::<FitFailure>(error))
        .or_else(|| with_parameters::<OptionsError>(error))
        .or_else(|| with_parameters::<PlanError>(error))
        .or_else(|| with_parameters::<ConversionError>(error))
        .unwrap_or_else(|| error.to_string())
}

/// Returns the name of the parameter for a setting.
fn parameter(setting: Setting) -> String {
    let unit = match setting {
        Setting::MaxThetaI | Setting::MaxThetaO | Setting::MinSeparation => "_degrees",
        Setting::Speed => "_degrees_per_second",
        Setting::Settle => "_seconds",
        _ => "",
    };
    setting.name() + unit
}

/// Any error of a computation without the GIL.
pub(crate) struct Failure(Box<dyn FnOnce() -> PyErr + Send>);

impl Failure {
    pub(crate) fn new(error: impl Error + Send + 'static) -> Self {
        Self(Box::new(|| to_exception(error)))
    }
}

impl From<PyErr> for Failure {
    fn from(error: PyErr) -> Self {
        Self(Box::new(|| error))
    }
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        failure.0()
    }
}

/// Rejects the first option that is set, if `unused` is true. `reason` is part of the message.
pub(crate) fn reject_unused(unused: bool, reason: &str, options: &[(&str, bool)]) -> PyResult<()> {
    match options.iter().find(|(_, is_set)| unused && *is_set) {
        Some((name, _)) => reject(format!("{name} has no effect: {reason}")),
        None => Ok(()),
    }
}

/// Returns a `GlimpseError` with this message.
pub(crate) fn reject<T>(message: impl Into<String>) -> PyResult<T> {
    Err(GlimpseError::new_err(message.into()))
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
