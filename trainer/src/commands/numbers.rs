//! Parsers of numbers on the command line. An error names the range of valid values.

use std::any::TypeId;
use std::fmt::Display;
use std::ops::RangeInclusive;
use std::str::FromStr;
use std::thread::available_parallelism;
use std::time::Duration;

use clap::{Arg, Command};
use glimpse_trainer::route::Axes;

use glimpse_core::recipe::MAX_SAMPLES;

/// The most threads, on machines that have no more cores: every one of them takes part in every
/// parallel loop, and thousands do nothing but wait for each other.
const MOST_THREADS: usize = 256;

/// Makes every option that takes a number accept a value with a leading minus, in a command and its
/// subcommands. The option's own parser then refuses it, and names the option, the value and the range.
pub(crate) fn with_negative_values(command: Command) -> Command {
    let numbers = [
        TypeId::of::<u32>(),
        TypeId::of::<u64>(),
        TypeId::of::<usize>(),
        TypeId::of::<f32>(),
        TypeId::of::<f64>(),
        TypeId::of::<[f32; 3]>(),
        TypeId::of::<Axes>(),
        TypeId::of::<Duration>(),
    ];
    let takes_number = |arg: &Arg| {
        let found = arg.get_value_parser().type_id();
        arg.get_action().takes_values() && numbers.iter().any(|number| found == *number)
    };
    command
        .mut_args(|arg| match takes_number(&arg) {
            true => arg.allow_hyphen_values(true),
            false => arg,
        })
        .mut_subcommands(with_negative_values)
}

/// n, the number of directions that are measured.
pub(crate) fn samples(text: &str) -> Result<usize, String> {
    match text.parse::<i128>() {
        Ok(samples) => usize::try_from(samples)
            .ok()
            .filter(|samples| (1..=MAX_SAMPLES).contains(samples))
            .ok_or_else(|| {
                format!("{text} samples are out of range: a pattern has 1 to {MAX_SAMPLES}")
            }),
        Err(_) => Err(format!("it is no whole number; give 1 to {MAX_SAMPLES}")),
    }
}

/// Threads to compute on.
pub(crate) fn threads(text: &str) -> Result<usize, String> {
    let most = available_parallelism()
        .map_or(1, usize::from)
        .max(MOST_THREADS);
    whole(1..=most)(text)
}

/// The seed of all random numbers.
pub(crate) fn seed(text: &str) -> Result<u64, String> {
    whole(0..=u64::MAX)(text)
}

/// Repetitions of random methods.
pub(crate) fn seeds(text: &str) -> Result<u64, String> {
    whole(1..=10_000)(text)
}

/// A share, 0 to 1.
pub(crate) fn share(text: &str) -> Result<f32, String> {
    number(0.0..=1.0)(text)
}

/// Degrees, above 0 and at most 180.
pub(crate) fn degrees(text: &str) -> Result<f32, String> {
    degrees_up_to(180.0, text)
}

/// The largest polar angle of an arm: degrees, above 0 and at most 90.
pub(crate) fn polar(text: &str) -> Result<f32, String> {
    degrees_up_to(90.0, text)
}

fn degrees_up_to(most: f32, text: &str) -> Result<f32, String> {
    let number = text.parse().ok();
    number
        .filter(|number| *number > 0.0 && *number <= most)
        .ok_or_else(|| format!("give degrees above 0, at most {most}"))
}

/// A finite number above 0.
pub(crate) fn positive(text: &str) -> Result<f64, String> {
    let number = text.parse().ok();
    number
        .filter(|number: &f64| *number > 0.0 && number.is_finite())
        .ok_or_else(|| "give a finite number above 0".to_owned())
}

/// A finite number, 0 or above.
pub(crate) fn not_negative(text: &str) -> Result<f32, String> {
    let number = text.parse().ok();
    number
        .filter(|number: &f32| *number >= 0.0 && number.is_finite())
        .ok_or_else(|| "give a finite number, 0 or above".to_owned())
}

/// A finite number of either sign.
pub(crate) fn finite(text: &str) -> Result<f32, String> {
    let number = text.parse().ok();
    number
        .filter(|number: &f32| number.is_finite())
        .ok_or_else(|| "give a finite number".to_owned())
}

/// Numbers separated by commas; None where one is not finite.
pub(crate) fn list(text: &str) -> Vec<Option<f64>> {
    let number = |text: &str| text.trim().parse().ok();
    let numbers = text.split(',').map(number);
    numbers
        .map(|found| found.filter(|number: &f64| number.is_finite()))
        .collect()
}

/// One number for all channels, or one for each.
pub(crate) fn channels(text: &str) -> Result<[f32; 3], String> {
    match list(text)[..] {
        [Some(one)] => Ok([one as f32; 3]),
        [Some(r), Some(g), Some(b)] => Ok([r, g, b].map(|number| number as f32)),
        _ => Err("give one number, or three with commas between them".to_owned()),
    }
}

/// One reflectance for all channels, or one for each: above 0, at most 2.
pub(crate) fn reflectances(text: &str) -> Result<[f32; 3], String> {
    let found = channels(text).ok();
    found
        .filter(|each| each.iter().all(|value| *value > 0.0 && *value <= 2.0))
        .ok_or_else(|| {
            "give one number above 0, at most 2, or three with commas between them".to_owned()
        })
}

/// A parser of a number within a range.
pub(crate) fn number<T>(
    range: RangeInclusive<T>,
) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static
where
    T: FromStr + PartialOrd + Display + Clone + Send + Sync + 'static,
{
    in_range("number", range)
}

/// A parser of a whole number within a range.
pub(crate) fn whole<T>(
    range: RangeInclusive<T>,
) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static
where
    T: FromStr + PartialOrd + Display + Clone + Send + Sync + 'static,
{
    in_range("whole number", range)
}

fn in_range<T>(
    what: &'static str,
    range: RangeInclusive<T>,
) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static
where
    T: FromStr + PartialOrd + Display + Clone + Send + Sync + 'static,
{
    move |text| {
        let found = text.parse().ok().filter(|found| range.contains(found));
        found.ok_or_else(|| format!("give a {what} of {} to {}", range.start(), range.end()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_out_of_range_is_told_the_range() {
        for text in ["1", "8", "4096"] {
            assert_eq!(samples(text).map(|n| n.to_string()), Ok(text.to_owned()));
        }
        for text in ["0", "4097", "-3", "99999999999999999999999"] {
            let message = samples(text).unwrap_err();
            assert!(
                message.contains(text) && message.contains("4096"),
                "{message}"
            );
        }
        for text in ["1e20", "8.5", "many", ""] {
            let message = samples(text).unwrap_err();
            assert!(message.contains("4096"), "{message}");
        }
        assert_eq!(threads("1"), Ok(1));
        for text in ["0", "9999999", "-1", "two"] {
            assert!(threads(text).is_err(), "{text}");
        }
        assert_eq!(seeds("5"), Ok(5));
        assert!(seeds("0").is_err());
    }

    #[test]
    fn one_number_counts_for_all_channels() {
        assert_eq!(channels("96"), Ok([96.0; 3]));
        assert_eq!(channels("96, 98.5,-1"), Ok([96.0, 98.5, -1.0]));
        for text in ["", "1,2", "1,2,3,4", "nan", "a", "1,inf,2"] {
            assert!(channels(text).is_err(), "{text}");
        }
    }
}
