//! The firmware's log.

use glimpse_core::scan::Reading;

/// Prefixes of log lines that tests wait for.
pub(crate) const FINISHED: &str = "finished";
pub(crate) const NO_HOST: &str = "no host";
pub(crate) const NEW_RECIPE: &str = "a new recipe";
pub(crate) const SAVED: &str = "saved readings";
pub(crate) const RESUMED: &str = "scan resumed";

/// A logged reading.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LoggedReading {
    pub(crate) index: u16,
    pub(crate) reading: Reading,
}

/// Returns the readings in the order of the log.
pub(crate) fn readings(log: &[String]) -> Vec<LoggedReading> {
    log.iter()
        .filter_map(|line| line.strip_prefix("reading "))
        .map(|line| {
            let (index, values) = line.split_once(": ").expect("an index");
            let words: Vec<&str> = values.split_whitespace().collect();
            let [red, green, blue, saturated] = words[..] else {
                panic!("{line}")
            };
            LoggedReading {
                index: index.parse().expect("a number"),
                reading: Reading {
                    brdf: [red, green, blue].map(float),
                    saturated: saturated == "true",
                },
            }
        })
        .collect()
}

/// Returns the samples of readings.
pub(crate) fn indices(readings: &[LoggedReading]) -> Vec<u16> {
    readings.iter().map(|reading| reading.index).collect()
}

/// Returns the bits of the fitted values.
pub(crate) fn values(log: &[String]) -> Vec<u32> {
    log.iter()
        .filter_map(|line| line.strip_prefix("values "))
        .flat_map(|line| {
            let (_, list) = line.split_once(": ").expect("a first index");
            let list = list.trim_matches(['[', ']']);
            let bytes: Vec<u8> = list.split(", ").map(|byte| bits(byte) as u8).collect();
            let words = bytes.as_chunks().0.iter();
            words
                .map(|word| u32::from_le_bytes(*word))
                .collect::<Vec<_>>()
        })
        .collect()
}

/// Returns the numbers in each line about lost steps: the arm, and the number of steps.
pub(crate) fn lost_steps(log: &[String]) -> Vec<Vec<i32>> {
    let lines = log
        .iter()
        .filter_map(|line| line.strip_prefix("lost steps: "));
    let numbers = |line: &str| {
        let words = line.split(|c: char| !c.is_ascii_digit() && c != '-');
        words.filter_map(|word| word.parse().ok()).collect()
    };
    lines.map(numbers).collect()
}

fn bits(word: &str) -> u32 {
    u32::from_str_radix(word, 16).expect("digits")
}

fn float(word: &str) -> f32 {
    f32::from_bits(bits(word))
}
