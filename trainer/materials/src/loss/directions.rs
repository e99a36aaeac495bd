//! The directions of the loss: always the same, uniform in the Rusinkiewicz angles over the valid region.

use std::f64::consts::{FRAC_PI_2, TAU};

use glimpse_core::geometry::{Angles, HalfDifference};

/// How many directions a fit is compared with its material at.
pub const DIRECTIONS: usize = 40_503;
/// Places among which those are valid.
const PLACES: u32 = 65_536;
/// The root of x^3 = x + 1, whose powers 1/x and 1/x^2 are the steps of the two-dimensional additive
/// recurrence that fills the unit square most evenly.
const RATIO: f64 = 1.324_717_957_244_746;

/// Returns [`DIRECTIONS`] Rusinkiewicz angles in radians, uniform in (theta_h, theta_d, phi_d) over the
/// valid region: both directions above the horizon; phi_d in \[0, 2 pi). They are not uniform over the
/// hemisphere: highlights, at small theta_h, count for more. `trainer/docs/losses.md` defines the loss.
///
/// They do not depend on a seed. A mean over as many directions drawn at random moves by several
/// per cent from draw to draw, since most of the loss of a glossy material lies at a theta_h of
/// very few degrees: how many of the directions come to lie there, and where, decides. Here theta_h
/// rises in equal steps, and theta_d and phi_d follow a recurrence that fills any range of theta_h
/// evenly. Shifted sets of this kind agree within half a per cent, mean by mean.
#[must_use]
pub fn directions() -> Vec<Angles<f32>> {
    among(PLACES)
}

/// A quarter as many, for who cannot afford more: means over them are up to some per cent off.
#[must_use]
pub fn coarse_directions() -> Vec<Angles<f32>> {
    among(PLACES / 4)
}

fn among(places: u32) -> Vec<Angles<f32>> {
    (0..places)
        .map(f64::from)
        .map(|index| {
            let share = |power: i32| (0.5 + index / RATIO.powi(power)).fract();
            Angles {
                theta_h: (FRAC_PI_2 * (index + 0.5) / f64::from(places)) as f32,
                theta_d: (FRAC_PI_2 * share(1)) as f32,
                phi_d: (TAU * share(2)) as f32,
            }
        })
        .filter(|angles| HalfDifference::from_angles(*angles).is_valid())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_part_of_the_valid_region_has_its_share() {
        let all = directions();
        assert_eq!(all.len(), DIRECTIONS);
        // The share of boxes of the valid region, against a fine grid of midpoints.
        let grid: Vec<[f64; 3]> = {
            const SIDE: usize = 64;
            let middle = |index: usize| (index as f64 + 0.5) / SIDE as f64;
            (0..SIDE.pow(3))
                .map(|i| [i / SIDE / SIDE, i / SIDE % SIDE, i % SIDE].map(middle))
                .filter(|[h, d, p]| {
                    let angles = Angles {
                        theta_h: (FRAC_PI_2 * h) as f32,
                        theta_d: (FRAC_PI_2 * d) as f32,
                        phi_d: (TAU * p) as f32,
                    };
                    HalfDifference::from_angles(angles).is_valid()
                })
                .collect()
        };
        let found: Vec<[f64; 3]> = all
            .iter()
            .map(|angles| {
                [
                    f64::from(angles.theta_h) / FRAC_PI_2,
                    f64::from(angles.theta_d) / FRAC_PI_2,
                    f64::from(angles.phi_d) / TAU,
                ]
            })
            .collect();
        for corner in [
            [0.125, 1.0, 1.0],
            [1.0, 0.125, 1.0],
            [1.0, 1.0, 0.25],
            [0.25, 0.25, 0.25],
        ] {
            let share = |points: &[[f64; 3]]| {
                let inside = |point: &&[f64; 3]| point.iter().zip(corner).all(|(x, end)| *x < end);
                points.iter().filter(inside).count() as f64 / points.len() as f64
            };
            let (found, expected) = (share(&found), share(&grid));
            assert!(
                (found - expected).abs() < 0.02 * expected,
                "{corner:?}: {found}, {expected}"
            );
        }
    }
}
