//! Arguments that are chosen by name.

use clap::ValueEnum;
use pyo3::prelude::*;

use crate::error::reject;

/// Returns the choice with a name. For an unknown name, the error names `argument` and all choices.
pub(crate) fn choose<T: Copy>(argument: &str, name: &str, choices: &[(&str, T)]) -> PyResult<T> {
    if let Some((_, choice)) = choices.iter().find(|(each, _)| *each == name) {
        return Ok(*choice);
    }
    let names: Vec<&str> = choices.iter().map(|(each, _)| *each).collect();
    reject(format!(
        "{argument} is `{name}`, and must be one of {}",
        names.join(", ")
    ))
}

/// Returns the value with a name, as on the command line.
pub(crate) fn choose_value<T: ValueEnum + Copy>(
    argument: &str,
    name: &str,
    name_of: fn(T) -> &'static str,
) -> PyResult<T> {
    let all = T::value_variants().iter();
    let named: Vec<(&str, T)> = all.map(|value| (name_of(*value), *value)).collect();
    choose(argument, name, &named)
}
