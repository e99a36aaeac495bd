//! The paper's loss of a whole BRDF: the mean cosine-weighted logarithmic error over many directions.
//!
//! `trainer/docs/results.md` defines the loss. Every evaluation uses the same [`directions`].

mod directions;

pub use directions::{DIRECTIONS, coarse_directions, directions};

use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::loss::cosine_weighted_log_error;

use crate::{Brdf, Material};

/// The largest number of directions in one call of [`Brdf::values_at`].
const BATCH: usize = 4096;

/// Returns the mean of |ln(1 + y c) - ln(1 + f c)| over directions and channels. c is cos(theta_i), clamped to
/// \[0, 1\].
///
/// `brdf` is f, the fitted BRDF. `reference` holds y, the measured BRDF at each element of `at`. Both are in linear
/// RGB, sr^-1, not times the cosine. The mean is computed in f64. If the lists differ in length, the longer one is
/// truncated. The mean of no samples is 0. A NaN value makes the mean NaN.
pub fn mean_log_error(brdf: &dyn Brdf, at: &[HalfDifference<f32>], reference: &[[f32; 3]]) -> f64 {
    let count = at.len().min(reference.len());
    let batches = at[..count].chunks(BATCH).zip(reference.chunks(BATCH));
    let sum: f64 = batches
        .map(|(at, reference)| sum_of_errors(at, reference, &brdf.values_at(at)))
        .sum();
    sum / (3 * count.max(1)) as f64
}

/// Returns [`mean_log_error`] from the values of the fitted BRDF at each element of `at`.
#[must_use]
pub fn mean_log_error_of_values(
    fitted: &[[f32; 3]],
    at: &[HalfDifference<f32>],
    reference: &[[f32; 3]],
) -> f64 {
    let count = at.len().min(reference.len()).min(fitted.len());
    sum_of_errors(at, reference, fitted) / (3 * count.max(1)) as f64
}

/// Returns the sum of errors over directions and channels.
fn sum_of_errors(at: &[HalfDifference<f32>], reference: &[[f32; 3]], fitted: &[[f32; 3]]) -> f64 {
    let samples = at.iter().zip(reference).zip(fitted);
    let errors = samples.map(|((at, measured), fitted)| {
        let error = cosine_weighted_log_error(*measured, *fitted, at.cos_theta_i(), 1.0).error;
        f64::from(error.value())
    });
    errors.sum()
}

/// Returns the loss of a BRDF against a material, at [`directions`].
#[must_use]
pub fn loss_between(brdf: &dyn Brdf, material: &dyn Material) -> f64 {
    let at = loss_directions();
    mean_log_error(brdf, &at, &material.values_at(&at))
}

/// Returns [`directions`] as half and difference vectors.
#[must_use]
pub fn loss_directions() -> Vec<HalfDifference<f32>> {
    let angles = directions().into_iter();
    angles.map(HalfDifference::from_angles).collect()
}

#[cfg(test)]
mod tests {
    use glimpse_core::geometry::Angles;

    use super::*;

    fn normal_incidence(count: usize) -> Vec<HalfDifference<f32>> {
        vec![HalfDifference::from_angles(Angles::default()); count]
    }

    #[test]
    fn averages_over_samples_and_channels() {
        // More than two batches. The errors of each sample's channels are ln 2, ln 3 and 0.
        let at = normal_incidence(2 * BATCH + 5);
        let reference = vec![[1.0, 0.0, 0.5]; at.len()];
        let brdf = |_: &HalfDifference<f32>| [0.0, 2.0, 0.5];
        let expected = 6.0_f64.ln() / 3.0;
        assert!((mean_log_error(&brdf, &at, &reference) - expected).abs() < 1e-7);
        let fitted = vec![[0.0, 2.0, 0.5]; at.len()];
        let from_values = mean_log_error_of_values(&fitted, &at, &reference);
        assert!((from_values - expected).abs() < 1e-7);
    }

    #[test]
    fn weights_by_cosine_of_incoming_direction() {
        let angles = Angles {
            theta_h: 0.4,
            theta_d: 0.3,
            phi_d: 0.7,
        };
        let at = [HalfDifference::from_angles(angles)];
        // 1 + f c = 2
        let brdf = |at: &HalfDifference<f32>| [1.0 / at.cos_theta_i(); 3];
        let error = mean_log_error(&brdf, &at, &[[0.0; 3]]);
        assert!((error - 2.0_f64.ln()).abs() < 1e-6, "{error}");
    }

    #[test]
    fn mean_of_no_samples_is_0_and_nan_propagates() {
        let nan = |_: &HalfDifference<f32>| [f32::NAN; 3];
        assert_eq!(mean_log_error(&nan, &[], &[]), 0.0);
        assert!(mean_log_error(&nan, &normal_incidence(2), &[[1.0; 3]; 2]).is_nan());
    }
}
