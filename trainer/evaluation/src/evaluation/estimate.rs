//! Mean and standard error over materials.

use serde::{Deserialize, Serialize};

/// A mean with its standard error: the standard deviation of the mean between random sets of equally many materials.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The mean.
    pub mean: f64,
    /// The standard error of the mean; None for fewer than two values.
    pub standard_error: Option<f64>,
}

impl Estimate {
    /// Estimates the mean of one value per material. The mean of no values is 0.
    #[must_use]
    pub fn from_values(values: &[f64]) -> Self {
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count.max(1.0);
        let sum_of_squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        Self {
            mean,
            standard_error: (values.len() > 1)
                .then(|| (sum_of_squares / (count - 1.0) / count).sqrt()),
        }
    }

    /// Estimates the mean of `values` minus `base`, material by material. Most of the variation between materials is
    /// common to both and cancels, so the standard error is much smaller than those of the two means. If the lists
    /// differ in length, the longer one is truncated.
    #[must_use]
    pub fn from_paired_differences(values: &[f64], base: &[f64]) -> Self {
        let pairs = values.iter().zip(base);
        let differences: Vec<f64> = pairs.map(|(value, base)| value - base).collect();
        Self::from_values(&differences)
    }
}
