//! The paper's loss of a whole BRDF: the mean cosine-weighted logarithmic error over many directions.
//!
//! `trainer/docs/results.md` defines the loss. Every evaluation uses the same [`directions`].

use crate::half_differences;
use std::f64::consts::{FRAC_PI_2, TAU};

use glimpse_core::geometry::{Angles, HalfDifference};
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
    half_differences(directions())
}

/// The number of directions of the loss.
pub const DIRECTIONS: usize = 40_503;
/// The number of candidates. [`DIRECTIONS`] of them are valid.
const CANDIDATES: u32 = 65_536;
/// The plastic ratio: the root x of x^3 = x + 1. 1/x and 1/x^2 are the steps of an additive recurrence that fills the
/// unit square evenly (the R2 sequence).
const PLASTIC_RATIO: f64 = 1.324_717_957_244_746;

/// Returns [`DIRECTIONS`] Rusinkiewicz angles in radians, uniform in (theta_h, theta_d, phi_d) over the valid region:
/// both directions are above the horizon, and phi_d is in \[0, 2 pi). They are not uniform over the hemisphere:
/// highlights, at small theta_h, have more weight. `trainer/docs/results.md` defines the loss.
///
/// The directions do not depend on a seed. Means over the same number of random directions vary by several percent,
/// because most of the loss of a glossy material is at a theta_h of a few degrees. In this set, theta_h increases in
/// equal steps. theta_d and phi_d follow a recurrence that is even within every range of theta_h. Means over shifted
/// sets of this kind agree within 0.5 percent.
#[must_use]
pub fn directions() -> Vec<Angles<f32>> {
    valid_directions(CANDIDATES)
}

/// Returns about a quarter as many angles as [`directions`], for cheap estimates. Means over the two lists differ by up
/// to several percent.
#[must_use]
pub fn coarse_directions() -> Vec<Angles<f32>> {
    valid_directions(CANDIDATES / 4)
}

/// Returns the valid directions among a given number of candidates.
fn valid_directions(candidates: u32) -> Vec<Angles<f32>> {
    (0..candidates)
        .map(f64::from)
        .map(|index| {
            let fraction = |power: i32| (0.5 + index / PLASTIC_RATIO.powi(power)).fract();
            Angles {
                theta_h: (FRAC_PI_2 * (index + 0.5) / f64::from(candidates)) as f32,
                theta_d: (FRAC_PI_2 * fraction(1)) as f32,
                phi_d: (TAU * fraction(2)) as f32,
            }
        })
        .filter(|angles| HalfDifference::from_angles(*angles).is_valid())
        .collect()
}

#[cfg(test)]
mod tests {
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
        let angles = Angles::from_array([0.4, 0.3, 0.7]);
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

    #[test]
    fn directions_are_uniform_over_the_valid_region() {
        let directions = directions();
        assert_eq!(directions.len(), DIRECTIONS);
        // Each box has the same fraction of the directions as of a fine grid of midpoints.
        const SIDE: usize = 64;
        let midpoint = |index: usize| (index as f64 + 0.5) / SIDE as f64;
        let grid_points: Vec<Angles<f32>> = (0..SIDE.pow(3))
            .map(|i| [i / SIDE / SIDE, i / SIDE % SIDE, i % SIDE].map(midpoint))
            .map(|[h, d, p]| Angles::from_array([FRAC_PI_2 * h, FRAC_PI_2 * d, TAU * p]))
            .map(|angles| angles.map(|angle| angle as f32))
            .filter(|angles| HalfDifference::from_angles(*angles).is_valid())
            .collect();
        for box_sizes in [
            [0.125, 1.0, 1.0],
            [1.0, 0.125, 1.0],
            [1.0, 1.0, 0.25],
            [0.25, 0.25, 0.25],
        ] {
            let [h, d, p] = box_sizes;
            let limits = [FRAC_PI_2 * h, FRAC_PI_2 * d, TAU * p];
            let fraction = |all: &[Angles<f32>]| {
                let is_inside = |at: &&Angles<f32>| {
                    let angles = at.to_array();
                    angles
                        .iter()
                        .zip(limits)
                        .all(|(angle, limit)| f64::from(*angle) < limit)
                };
                all.iter().filter(is_inside).count() as f64 / all.len() as f64
            };
            let (actual, expected) = (fraction(&directions), fraction(&grid_points));
            assert!(
                (actual - expected).abs() < 0.02 * expected,
                "box {box_sizes:?}: {actual}, expected {expected}"
            );
        }
    }
}
