//! Numbers on the command line: refused by a sentence that says which ones are taken.

use std::thread::available_parallelism;

use glimpse_core::recipe::MAX_SAMPLES;

/// The most threads, on machines that have no more cores: every one of them takes part in every
/// parallel loop, and thousands do nothing but wait for each other.
const MOST_THREADS: usize = 256;

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
    whole(text, most)
}

/// Repetitions of random methods.
pub(crate) fn seeds(text: &str) -> Result<u64, String> {
    whole(text, 10_000).map(|seeds| seeds as u64)
}

/// A share, 0 to 1.
pub(crate) fn share(text: &str) -> Result<f32, String> {
    let number = text.parse().ok();
    number
        .filter(|number| (0.0..=1.0).contains(number))
        .ok_or_else(|| "give a number of 0 to 1".to_owned())
}

/// Degrees, above 0 and at most 180.
pub(crate) fn degrees(text: &str) -> Result<f32, String> {
    let number = text.parse().ok();
    number
        .filter(|number| *number > 0.0 && *number <= 180.0)
        .ok_or_else(|| "give degrees above 0, at most 180".to_owned())
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

fn whole(text: &str, most: usize) -> Result<usize, String> {
    let number = text.parse().ok();
    number
        .filter(|number| (1..=most).contains(number))
        .ok_or_else(|| format!("give a whole number of 1 to {most}"))
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
