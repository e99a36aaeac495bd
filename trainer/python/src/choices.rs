//! Arguments that are chosen by name, and limits of a machine.

use clap::ValueEnum;
use glimpse_core::gonio::Limits;
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

/// Returns limits from arguments in degrees, with `default` for those that are None. The caller validates them.
pub(crate) fn limits(
    default: Limits,
    max_theta_i: Option<f64>,
    max_theta_o: Option<f64>,
    min_separation: Option<f64>,
) -> Limits {
    let polar = |degrees: f64| match degrees == 90.0 {
        // Exactly pi/2: the conversion below could round it up.
        true => Limits::NONE.max_theta_i,
        false => (degrees as f32).to_radians(),
    };
    Limits {
        max_theta_i: max_theta_i.map_or(default.max_theta_i, polar),
        max_theta_o: max_theta_o.map_or(default.max_theta_o, polar),
        min_separation: min_separation.map_or(default.min_separation, |degrees| {
            (degrees as f32).to_radians()
        }),
        ..default
    }
}
