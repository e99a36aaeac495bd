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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn computes_standard_error_of_the_mean() {
        // By hand: deviations -1, 0, 1; variance 1; variance of the mean 1/3.
        let estimate = Estimate::from_values(&[1.0, 2.0, 3.0]);
        assert_eq!(estimate.mean, 2.0);
        let error = estimate.standard_error.unwrap();
        assert!((error - (1.0_f64 / 3.0).sqrt()).abs() < 1e-12, "{error}");
        let single = Estimate::from_values(&[5.0]);
        assert_eq!((single.mean, single.standard_error), (5.0, None));
        assert_eq!(Estimate::from_values(&[]).mean, 0.0);
    }

    #[test]
    fn paired_differences_cancel_common_variation() {
        let base = [1.0, 20.0, 300.0];
        let values = base.map(|value| value + 0.5);
        let estimate = Estimate::from_paired_differences(&values, &base);
        assert_eq!(estimate.mean, 0.5);
        assert!(estimate.standard_error.unwrap() < 1e-12);
    }
}
