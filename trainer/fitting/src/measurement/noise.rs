//! The noise of readings: stated, estimated from repeated readings, or assumed.

use clap::ValueEnum;
use serde::Serialize;

use super::rows::ReadingRows;

/// The standard deviation of a reading's noise, relative to the reading, if it is unknown: that of a common instrument.
pub const DEFAULT_NOISE: f32 = 0.02;
/// The smallest standard deviation of a sample's noise, relative to the reading: no instrument is better, and the posterior
/// of exact readings would be singular. A stated noise of 0 is raised to it.
const MIN_NOISE: f32 = 1e-3;
/// The minimum number of degrees of freedom of an estimate, which then is typically off by a third.
const MIN_FREEDOM: f32 = 4.0;

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
    /// `of_rows` is the index of each row's sample. `repeats` are the degrees of freedom and the coefficient of variation of
    /// each sample's readings; None if it is unknown.
    pub(super) fn noise_of_samples(
        &self,
        of_rows: &[usize],
        repeats: &[Option<(f32, f32)>],
    ) -> (NoiseSummary, Vec<f32>) {
        let all_stated = self.readings.iter().all(|row| row.noise.is_some());
        let freedom: f32 = repeats.iter().flatten().map(|(freedom, _)| freedom).sum();
        let (common, source) = match self.noise {
            Some(noise) => (noise, NoiseSource::Stated),
            None if all_stated => (DEFAULT_NOISE, NoiseSource::Stated),
            None if freedom >= MIN_FREEDOM => (median_deviation(repeats), NoiseSource::Repeated),
            None => (DEFAULT_NOISE, NoiseSource::Default),
        };
        // Sums of variances, and numbers of readings.
        let mut sums = vec![(0.0_f32, 0.0_f32); repeats.len()];
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

/// Returns the median of the standard deviations of repeated readings, so that a wrong row or a dark sample does not count.
/// Each is divided by the median of its estimate: that of chi squared with n degrees of freedom is about n (1 - 2 / 9n)^3
/// (Wilson and Hilferty).
fn median_deviation(repeats: &[Option<(f32, f32)>]) -> f32 {
    let repeats = repeats.iter().flatten();
    let deviations =
        repeats.map(|(freedom, variation)| variation / (1.0 - 2.0 / (9.0 * freedom)).powf(1.5));
    let mut deviations: Vec<f32> = deviations.collect();
    deviations.sort_by(f32::total_cmp);
    deviations[deviations.len() / 2]
}
