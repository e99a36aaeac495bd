//! Errors as exceptions, with the trainer's own sentences.

use std::error::Error;
use std::io;

use glimpse_materials::setting::{NamesSettings, Setting};
use glimpse_materials::{ShareError, SourceError};
use glimpse_trainer::evaluation::EvaluationError;
use glimpse_trainer::measurement::FitFailure;
use glimpse_training::meta::options::CompletionOptionsError;
use glimpse_training::meta::run::TrainError;
use pyo3::exceptions::{PyFileNotFoundError, PyPermissionError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;

pyo3::create_exception!(
    glimpse_brdf,
    GlimpseError,
    PyValueError,
    "What Glimpse refuses, or what went wrong, in a sentence with a remedy."
);

/// The exception of an error of the library: that of Python for a file that is missing or must not be
/// opened, and `GlimpseError` for all else.
pub(crate) fn raised(error: impl Error + 'static) -> PyErr {
    let error: &(dyn Error + 'static) = &error;
    let text = message(error);
    if matches!(error.downcast_ref(), Some(SourceError::Missing(_))) {
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

/// The message of an error, which names settings by Python's parameters.
fn message(error: &(dyn Error + 'static)) -> String {
    fn with_parameters<E: NamesSettings + Error + 'static>(
        error: &(dyn Error + 'static),
    ) -> Option<String> {
        Some(error.downcast_ref::<E>()?.message(parameter))
    }
    if let Some(TrainError::CompletionOptions(error)) = error.downcast_ref() {
        return error.message(parameter);
    }
    with_parameters::<EvaluationError>(error)
        .or_else(|| with_parameters::<ShareError>(error))
        .or_else(|| with_parameters::<FitFailure>(error))
        .or_else(|| with_parameters::<CompletionOptionsError>(error))
        .unwrap_or_else(|| error.to_string())
}

/// The parameter of a setting.
fn parameter(setting: Setting) -> &'static str {
    match setting {
        Setting::MaxThetaI => "max_theta_i_degrees",
        Setting::MaxThetaO => "max_theta_o_degrees",
        Setting::MinSeparation => "min_separation_degrees",
        other => other.name(),
    }
}

/// An exception of these words.
pub(crate) fn refused<T>(text: impl Into<String>) -> PyResult<T> {
    Err(GlimpseError::new_err(text.into()))
}

/// What comes of a panic, which would be a defect: an exception, and no end of the interpreter.
pub(crate) fn defect(payload: &(dyn std::any::Any + Send)) -> PyErr {
    let text = payload.downcast_ref::<String>().map(String::as_str);
    let text = text.or_else(|| payload.downcast_ref::<&str>().copied());
    PyRuntimeError::new_err(format!(
        "a defect of glimpse_brdf, please report it: {}",
        text.unwrap_or("of unknown kind")
    ))
}
