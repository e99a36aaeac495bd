//! Poses of the arms for each sample of a recipe.

use glimpse_core::error::Error;
use glimpse_core::geometry::Directions;
use glimpse_core::gonio::Limits;
use glimpse_core::recipe::Recipe;

use super::axes::{Axes, axes_from_angles};

/// A sample and the poses in which it can be measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Stop {
    /// The sample's index in the recipe's pattern, from 0.
    pub index: usize,
    /// The poses, at least one. The pattern's own pose is first if it is reachable.
    pub poses: Vec<Pose>,
}

/// A pose of the arms that measures a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// The directions of the arms in degrees: polar angles of 0 to 90, azimuths of -180 to 180.
    pub arms: Axes,
    /// True if light and sensor are exchanged.
    pub swapped: bool,
}

/// A sample that a machine cannot reach in any pose.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "sample {index} (theta_i {:.2}, phi_i {:.2}, theta_o {:.2}, phi_o {:.2} degrees): {reason}",
    arms.theta_i, arms.phi_i, arms.theta_o, arms.phi_o
)]
pub struct OutOfReach {
    /// The sample's index in the recipe's pattern, from 0.
    pub index: usize,
    /// The directions of the arms for this sample, in degrees.
    pub arms: Axes,
    /// The limit that is exceeded, and by how much.
    pub reason: Error,
}

/// Returns the recipe's samples, in the recipe's order, with the poses within the limits. If `swap` is true, these
/// include poses with light and sensor exchanged.
///
/// # Errors
/// All unreachable samples.
pub fn stops(
    recipe: &Recipe<'_>,
    limits: &Limits,
    swap: bool,
) -> Result<Vec<Stop>, Vec<OutOfReach>> {
    let mut stops = Vec::new();
    let mut unreachable = Vec::new();
    for (angles, (index, directions)) in recipe.pattern().zip(recipe.directions()) {
        let index = usize::from(index);
        let arms = axes_from_angles(angles);
        let exchanged = Directions {
            incoming: directions.outgoing,
            outgoing: directions.incoming,
        };
        let own_check = limits.check(&directions);
        let mut poses = Vec::new();
        if own_check.is_ok() {
            poses.push(Pose {
                arms,
                swapped: false,
            });
        }
        if swap && limits.check(&exchanged).is_ok() {
            poses.push(Pose {
                arms: arms.swapped(),
                swapped: true,
            });
        }
        match own_check {
            Err(reason) if poses.is_empty() => {
                unreachable.push(OutOfReach {
                    index,
                    arms,
                    reason,
                });
            }
            _ => stops.push(Stop { index, poses }),
        }
    }
    match unreachable.is_empty() {
        true => Ok(stops),
        false => Err(unreachable),
    }
}

#[cfg(test)]
mod tests {
    use glimpse_core::error::ErrorCode;
    use glimpse_core::gonio::Machine;

    use super::*;

    const NEURAL: &[u8] = include_bytes!("../../../../core/examples/recipes/neural-n8.recipe");

    #[test]
    fn reports_all_unreachable_samples_and_swap_reaches_more() {
        let recipe = Recipe::parse(NEURAL).expect("the recipe is valid");
        let limits = Limits {
            max_theta_o: 80_f32.to_radians(),
            ..Limits::NONE
        };
        let unreachable =
            stops(&recipe, &limits, false).expect_err("some samples are out of reach");
        let indices: Vec<usize> = unreachable.iter().map(|sample| sample.index).collect();
        assert_eq!(indices, [6, 7]);
        let first = recipe
            .out_of_reach(&Machine::new(limits))
            .expect("a sample is out of reach");
        assert_eq!((first.0, first.1), (6, unreachable[0].reason));
        assert_eq!(unreachable[0].reason.code, ErrorCode::MaxThetaO);
        let message = unreachable[0].to_string();
        for part in ["6", "56.90", "86.76", "max_theta_o"] {
            assert!(message.contains(part), "no {part} in {message}");
        }
        let stops = stops(&recipe, &limits, true).expect("all samples are within reach");
        let swapped = |index: usize| -> Vec<bool> {
            stops[index].poses.iter().map(|pose| pose.swapped).collect()
        };
        assert_eq!((swapped(5), swapped(6)), (vec![false, true], vec![true]));
    }
}
