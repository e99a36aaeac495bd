//! The fixed directions of the loss, uniform in the Rusinkiewicz angles over the valid region.

use std::f64::consts::{FRAC_PI_2, TAU};

use glimpse_core::geometry::{Angles, HalfDifference};

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
