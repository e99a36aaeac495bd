//! Parsers of numbers on the command line. An error names the range of valid values.

use std::any::TypeId;
use std::fmt::Display;
use std::ops::RangeInclusive;
use std::str::FromStr;

use clap::{Arg, Command};
use glimpse_core::geometry::Arms;

/// Lets every numeric option of a command and its subcommands accept a value with a leading minus. The option's
/// parser then rejects the value, with an error that names the option, the value and the range.
pub(crate) fn with_negative_values(command: Command) -> Command {
    let numbers = [
        TypeId::of::<u32>(),
        TypeId::of::<u64>(),
        TypeId::of::<usize>(),
        TypeId::of::<f32>(),
        TypeId::of::<f64>(),
        TypeId::of::<[f32; 3]>(),
        TypeId::of::<Arms<f64>>(),
    ];
    let takes_number = |arg: &Arg| {
        let value_type = arg.get_value_parser().type_id();
        arg.get_action().takes_values() && numbers.iter().any(|number| value_type == *number)
    };
    command
        .mut_args(|arg| match takes_number(&arg) {
            true => arg.allow_hyphen_values(true),
            false => arg,
        })
        .mut_subcommands(with_negative_values)
}

/// Parses a finite number of either sign.
pub(crate) fn finite(text: &str) -> Result<f32, String> {
    checked(text, |number: &f32| number.is_finite(), "a finite number")
}

/// Parses a value that must be valid.
fn checked<T: FromStr>(
    text: &str,
    is_valid: impl FnOnce(&T) -> bool,
    expected: &str,
) -> Result<T, String> {
    let value = text.parse().ok().filter(is_valid);
    value.ok_or_else(|| format!("give {expected}"))
}

/// Parses one number for all channels, or one for each channel.
pub(crate) fn channels(text: &str) -> Result<[f32; 3], String> {
    let numbers = text.split(',').map(|number| finite(number.trim()));
    let numbers: Result<Vec<f32>, String> = numbers.collect();
    match numbers.unwrap_or_default()[..] {
        [one] => Ok([one; 3]),
        [r, g, b] => Ok([r, g, b]),
        _ => Err("give one number, or three separated by commas".to_owned()),
    }
}

/// Parses one reflectance for all channels, or one for each channel, above 0 and at most 2.
pub(crate) fn reflectances(text: &str) -> Result<[f32; 3], String> {
    let is_valid = |value: &f32| *value > 0.0 && *value <= 2.0;
    match channels(text) {
        Ok(reflectances) if reflectances.iter().all(is_valid) => Ok(reflectances),
        _ => Err("give one number above 0 and at most 2, or three separated by commas".to_owned()),
    }
}

/// Returns a parser of a number within a range.
pub(crate) fn number<T: FromStr + PartialOrd + Display + Clone + Send + Sync + 'static>(
    range: RangeInclusive<T>,
) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static {
    move |text| {
        let kind = if T::from_str("0.5").is_ok() {
            "a number"
        } else {
            "an integer"
        };
        let expected = format!("{kind} from {} to {}", range.start(), range.end());
        checked(text, |value| range.contains(value), &expected)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_number_sets_all_channels() {
        assert_eq!(channels("96"), Ok([96.0; 3]));
        assert_eq!(channels("96, 98.5,-1"), Ok([96.0, 98.5, -1.0]));
        for text in ["", "1,2", "1,2,3,4", "nan", "a", "1,inf,2"] {
            assert!(channels(text).is_err(), "{text}");
        }
    }
}
