//! Detection of outliers: readings that are improbable, given the other readings.
//!
//! The posterior of the coefficients from the other readings predicts each one. A wrong reading distorts the predictions of
//! the others, but is itself furthest from its prediction. So the furthest one is removed, and the others are predicted
//! again.
//!
//! A reading of an unusual material is improbable, too, but it helps to predict the others. Only the worst outlier is
//! excluded from the fit, and only if the others predict each other better without it.

use glimpse_training::linear::{
    CoefficientPrior, LeftOut, Posterior, PosteriorReading, gain_without,
};

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

/// The result of outlier detection.
#[derive(Clone, Debug)]
pub struct OutlierReport {
    /// The prediction of each sample from the others; None if its reading is missing. For an outlier, it is the prediction
    /// just before its removal. For any other reading, it is the prediction after the removal of all outliers.
    pub predictions: Vec<Option<LeftOut>>,
    /// The samples of outliers, worst first.
    pub outliers: Vec<usize>,
    /// The sample of the worst outlier, if the other readings predict each other better without it.
    pub excluded: Option<usize>,
    /// The z-score above which a reading is an outlier.
    pub threshold: f64,
}

impl OutlierReport {
    /// Finds outliers among the readings of samples, None if missing.
    #[must_use]
    pub fn new(prior: &CoefficientPrior, readings: &[Option<PosteriorReading>]) -> Self {
        let all = readings.iter().enumerate();
        let mut present: Vec<usize> = all
            .filter_map(|(sample, reading)| reading.map(|_| sample))
            .collect();
        let predict = |present: &[usize]| -> Vec<LeftOut> {
            let readings = present.iter().filter_map(|sample| readings[*sample]);
            let posterior = Posterior::new(prior, &readings.collect::<Vec<_>>());
            posterior.map_or_else(Vec::new, |posterior| posterior.left_out())
        };
        let mut report = Self {
            predictions: vec![None; readings.len()],
            outliers: Vec::new(),
            excluded: None,
            threshold: outlier_threshold(present.len()),
        };
        let max_outliers = (present.len() / READINGS_PER_OUTLIER).min(MAX_OUTLIERS);
        let mut left_out = predict(&present);
        loop {
            for (sample, prediction) in present.iter().zip(&left_out) {
                report.predictions[*sample] = Some(*prediction);
            }
            let each = left_out
                .iter()
                .map(|prediction| prediction.z.abs())
                .enumerate();
            let worst = each.max_by(|(_, one), (_, other)| one.total_cmp(other));
            let Some((index, _)) = worst.filter(|(_, z)| *z > report.threshold) else {
                return report;
            };
            if report.outliers.len() == max_outliers {
                return report;
            }
            let sample = present.remove(index);
            let others = predict(&present);
            if report.outliers.is_empty() && gain_without(&left_out, index, &others) > MIN_GAIN {
                report.excluded = Some(sample);
            }
            report.outliers.push(sample);
            left_out = others;
        }
    }
}
