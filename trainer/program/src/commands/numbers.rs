//! Parsers of numbers on the command line. An error names the range of valid values.

use std::any::TypeId;
use std::fmt::Display;
use std::ops::RangeInclusive;
use std::str::FromStr;
use std::thread::available_parallelism;

use clap::{Arg, Command};
use glimpse_core::geometry::Arms;

/// Maximum number of threads on machines with fewer cores. All threads take part in every parallel loop, and
/// thousands of them mostly wait for each other.
const MAX_THREADS: usize = 256;

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

/// Parses the number of threads.
pub(crate) fn threads(text: &str) -> Result<usize, String> {
    let max = available_parallelism()
        .map_or(1, usize::from)
        .max(MAX_THREADS);
    number(1..=max)(text)
}

/// Parses the number of seeds, 1 to 10000.
pub(crate) fn seeds(text: &str) -> Result<u64, String> {
    number(1..=10_000)(text)
}

/// Parses a share, 0 to 1.
pub(crate) fn share(text: &str) -> Result<f32, String> {
    number(0.0..=1.0)(text)
}

/// Parses a finite number of 0 or above.
pub(crate) fn nonnegative(text: &str) -> Result<f32, String> {
    let is_valid = |number: &f32| *number >= 0.0 && number.is_finite();
    checked(text, is_valid, "a finite number of 0 or above")
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

/// Parses numbers separated by commas. Returns None in place of each that is malformed or not finite.
pub(crate) fn list(text: &str) -> Vec<Option<f64>> {
    let number = |text: &str| text.trim().parse().ok();
    let numbers = text.split(',').map(number);
    numbers
        .map(|number| number.filter(|number: &f64| number.is_finite()))
        .collect()
}

/// Parses one number for all channels, or one for each channel.
pub(crate) fn channels(text: &str) -> Result<[f32; 3], String> {
    match list(text)[..] {
        [Some(one)] => Ok([one as f32; 3]),
        [Some(r), Some(g), Some(b)] => Ok([r, g, b].map(|number| number as f32)),
        _ => Err("give one number, or three separated by commas".to_owned()),
    }
}

/// Parses one reflectance for all channels, or one for each channel, above 0 and at most 2.
pub(crate) fn reflectances(text: &str) -> Result<[f32; 3], String> {
    let reflectances = channels(text).ok();
    reflectances
        .filter(|channels| channels.iter().all(|value| *value > 0.0 && *value <= 2.0))
        .ok_or_else(|| {
            "give one number above 0 and at most 2, or three separated by commas".to_owned()
        })
}

/// Returns a parser of a number within a range.
pub(crate) fn number<T>(
    range: RangeInclusive<T>,
) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static
where
    T: FromStr + PartialOrd + Display + Clone + Send + Sync + 'static,
{
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
