//! The noise of readings: stated, estimated from repeated readings, or assumed.

use clap::ValueEnum;
use serde::Serialize;

use super::rows::ReadingRows;
use crate::linear::{DEFAULT_NOISE, MIN_NOISE};

/// The minimum number of repeated samples for an estimate.
const MIN_REPEATED: usize = 2;

/// The source of the noise of readings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum NoiseSource {
    /// The rows or the options state it.
    Stated,
    /// It was estimated from repeated readings.
    Repeated,
    /// It is [`DEFAULT_NOISE`].
    Default,
}

/// The noise of readings.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct NoiseSummary {
    /// The source, for rows that do not state their own noise.
    pub source: NoiseSource,
    /// The largest standard deviation of a row's noise, relative to its reading.
    pub largest: f32,
}

impl ReadingRows {
    /// Returns the noise of rows, and the standard deviation of that of each sample's mean reading, relative to the reading.
    /// `of_rows` is the index of each row's sample, and `variations` has the coefficients of variation of repeated readings.
    pub(super) fn noise_of_samples(
        &self,
        of_rows: &[usize],
        samples: usize,
        mut variations: Vec<f32>,
    ) -> (NoiseSummary, Vec<f32>) {
        let all_stated = self.readings.iter().all(|row| row.noise.is_some());
        // Their median, so that a wrong row or a dark sample does not count.
        variations.sort_by(f32::total_cmp);
        let repeated = variations.get(variations.len() / 2).copied();
        let repeated = repeated.filter(|_| variations.len() >= MIN_REPEATED);
        let (common, source) = match (self.noise, repeated) {
            (Some(noise), _) => (noise, NoiseSource::Stated),
            (None, _) if all_stated => (DEFAULT_NOISE, NoiseSource::Stated),
            (None, Some(noise)) => (noise, NoiseSource::Repeated),
            (None, None) => (DEFAULT_NOISE, NoiseSource::Default),
        };
        // Sums of variances, and numbers of readings.
        let mut sums = vec![(0.0_f32, 0.0_f32); samples];
        let mut largest = MIN_NOISE;
        for (row, sample) in self.readings.iter().zip(of_rows) {
            let noise = row.noise.unwrap_or(common);
            largest = noise.max(largest);
            sums[*sample].0 += noise * noise;
            sums[*sample].1 += 1.0;
        }
        let noise = sums.iter().map(|(sum, count)| sum.sqrt() / count.max(1.0));
        let noise = noise.map(|noise| noise.max(MIN_NOISE)).collect();
        (NoiseSummary { source, largest }, noise)
    }
}
