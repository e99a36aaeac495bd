//! How far a mean over materials can be relied on.

use serde::{Deserialize, Serialize};

/// A mean, and how far another choice of as many materials would move it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The mean.
    pub mean: f64,
    /// Its standard error; None of fewer than two values.
    pub standard_error: Option<f64>,
}

impl Estimate {
    /// Of one value for each material. The mean of nothing is 0.
    #[must_use]
    pub fn of(values: &[f64]) -> Self {
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count.max(1.0);
        let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        Self {
            mean,
            standard_error: (values.len() > 1).then(|| (squares / (count - 1.0) / count).sqrt()),
        }
    }

    /// Of `values` less `base`, material by material: most of what makes materials differ is common
    /// to both, so that the difference is known far better than either mean. If the lists differ in
    /// length the longer one is cut.
    #[must_use]
    pub fn of_differences(values: &[f64], base: &[f64]) -> Self {
        let pairs = values.iter().zip(base);
        let differences: Vec<f64> = pairs.map(|(value, base)| value - base).collect();
        Self::of(&differences)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_standard_error_is_that_of_the_mean() {
        // By hand: deviations -1, 0, 1; variance 1; of the mean 1/3.
        let estimate = Estimate::of(&[1.0, 2.0, 3.0]);
        assert_eq!(estimate.mean, 2.0);
        let error = estimate.standard_error.unwrap();
        assert!((error - (1.0_f64 / 3.0).sqrt()).abs() < 1e-12, "{error}");
        let single = Estimate::of(&[5.0]);
        assert_eq!((single.mean, single.standard_error), (5.0, None));
        assert_eq!(Estimate::of(&[]).mean, 0.0);
    }

    #[test]
    fn what_is_common_to_a_pair_cancels() {
        let base = [1.0, 20.0, 300.0];
        let values = base.map(|value| value + 0.5);
        let estimate = Estimate::of_differences(&values, &base);
        assert_eq!(estimate.mean, 0.5);
        assert!(estimate.standard_error.unwrap() < 1e-12);
    }
}
