//! Arguments that are chosen by name.

use clap::ValueEnum;
use glimpse_fitting::choice::Choice;

use crate::error::{Result, reject};

/// Returns the choice with a name. For an unknown name, the error names `argument` and all choices.
pub(crate) fn choose<T: Copy>(
    argument: &str,
    name: &str,
    choices: &[(impl AsRef<str>, T)],
) -> Result<T> {
    if let Some((_, choice)) = choices.iter().find(|(choice, _)| choice.as_ref() == name) {
        return Ok(*choice);
    }
    let names: Vec<&str> = choices.iter().map(|(choice, _)| choice.as_ref()).collect();
    reject(format!(
        "{argument} is `{name}`, and must be one of {}",
        names.join(", ")
    ))
}

/// Returns the value with a name, as on the command line.
pub(crate) fn choose_value<T: ValueEnum + Copy>(argument: &str, name: &str) -> Result<T> {
    let all = T::value_variants().iter();
    let named: Vec<(String, T)> = all.map(|value| (value.name(), *value)).collect();
    choose(argument, name, &named)
}
