//! Detection of outliers: readings that are improbable, given the other readings.
//!
//! The posterior of the coefficients from the other readings predicts each one. A wrong reading distorts the predictions of
//! the others, but is itself furthest from its prediction. So the furthest one is removed, and the others are predicted
//! again.
//!
//! A reading of an unusual material is improbable, too, but it helps to predict the others. Only the worst outlier is
//! excluded from the fit, and only if the others predict each other better without it.

use crate::linear::{Posterior, gain_without};

use super::readings::SampleReading;

/// The minimum number of readings per outlier. With fewer others, predictions are unreliable.
const READINGS_PER_OUTLIER: usize = 4;
/// The largest number of outliers.
const MAX_OUTLIERS: usize = 16;
/// The gain above which the worst outlier is excluded from the fit.
const MIN_GAIN: f64 = 0.5;

/// Returns the z-score above which one of k readings is an outlier: sqrt(3 + 2 ln k). The largest of k standard normal
/// numbers is about sqrt(2 ln k), so the rate of false positives does not increase with k. The constant 3 was chosen on
/// procedural materials: with 1, a tenth of correct scans of eight readings has an outlier.
fn outlier_threshold(readings: usize) -> f64 {
    (3.0 + 2.0 * (readings.max(1) as f64).ln()).sqrt()
}

/// The outliers among the readings of samples.
#[derive(Clone, Debug)]
pub struct Outliers {
    /// The samples of outliers, worst first.
    pub samples: Vec<usize>,
    /// The sample of the worst outlier, if the other readings predict each other better without it.
    pub excluded: Option<usize>,
    /// The z-score above which a reading is an outlier.
    pub threshold: f64,
}

impl Outliers {
    /// Finds outliers among the samples of a posterior's readings, and stores the prediction of each reading from the others.
    #[must_use]
    pub fn find(mut posterior: Posterior, known: &[usize], readings: &mut [SampleReading]) -> Self {
        let mut outliers = Self {
            samples: Vec::new(),
            excluded: None,
            threshold: outlier_threshold(known.len()),
        };
        let max_outliers = (known.len() / READINGS_PER_OUTLIER).min(MAX_OUTLIERS);
        let mut left_out = posterior.left_out();
        loop {
            let present = known.iter().zip(&left_out).enumerate();
            let present = present.filter_map(|(index, (sample, prediction))| {
                let prediction = prediction.as_ref()?;
                readings[*sample].prediction = Some(*prediction);
                Some((index, *sample, prediction.z.abs()))
            });
            let worst = present.max_by(|(_, _, one), (_, _, other)| one.total_cmp(other));
            let Some((index, sample, _)) = worst.filter(|(_, _, z)| *z > outliers.threshold) else {
                return outliers;
            };
            if outliers.samples.len() == max_outliers {
                return outliers;
            }
            let Some(others) = posterior.without(index) else {
                return outliers;
            };
            posterior = others;
            let others = posterior.left_out();
            if outliers.samples.is_empty() && gain_without(&left_out, index, &others) > MIN_GAIN {
                outliers.excluded = Some(sample);
            }
            outliers.samples.push(sample);
            left_out = others;
        }
    }
}
