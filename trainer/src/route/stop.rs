//! Where the arms have to stand for each sample of a recipe.

use glimpse_core::geometry::{Angles, Directions, HalfDifference};
use glimpse_core::gonio::{Limits, Unreachable};
use glimpse_core::recipe::Recipe;

use super::axes::Axes;

/// A sample, and the ways in which it can be measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Stop {
    /// Its number in the recipe's pattern, from 0.
    pub index: usize,
    /// At least one; the pattern's own comes first, if it is within reach.
    pub ways: Vec<Way>,
}

/// One way to measure a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Way {
    /// Where the arms point, degrees: polar angles of 0 to 90, azimuths of -180 to 180.
    pub arms: Axes,
    /// True if light and sensor are exchanged.
    pub swapped: bool,
}

/// A sample that a machine does not reach in any way.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "sample {index} (theta_i {:.2}, phi_i {:.2}, theta_o {:.2}, phi_o {:.2} degrees): {why}",
    arms.theta_i, arms.phi_i, arms.theta_o, arms.phi_o
)]
pub struct OutOfReach {
    /// Its number in the recipe's pattern, from 0.
    pub index: usize,
    /// Where the arms would have to point, degrees.
    pub arms: Axes,
    /// Which limit is passed, and by how much.
    pub why: Unreachable,
}

/// Where the recipe's pattern has the arms, degrees: what [`Recipe::directions`] are, in double
/// precision.
#[must_use]
pub fn arms_of(angles: Angles<f32>) -> Axes {
    let directions = HalfDifference::from_angles(Angles {
        theta_h: f64::from(angles.theta_h),
        theta_d: f64::from(angles.theta_d),
        phi_d: f64::from(angles.phi_d),
    })
    .directions();
    let spherical = |[x, y, z]: [f64; 3]| [x.hypot(y).atan2(z), y.atan2(x)].map(f64::to_degrees);
    let [theta_i, phi_i] = spherical(directions.incoming);
    let [theta_o, phi_o] = spherical(directions.outgoing);
    Axes {
        theta_i,
        phi_i,
        theta_o,
        phi_o,
    }
}

/// The recipe's samples, in its own order, with the ways that are within the limits; if `swap`, also
/// those with light and sensor exchanged.
///
/// # Errors
/// All samples that are out of reach.
pub fn stops(
    recipe: &Recipe<'_>,
    limits: &Limits,
    swap: bool,
) -> Result<Vec<Stop>, Vec<OutOfReach>> {
    let mut reached = Vec::new();
    let mut missed = Vec::new();
    for (angles, (index, directions)) in recipe.pattern().zip(recipe.directions()) {
        let index = usize::from(index);
        let arms = arms_of(angles);
        let exchanged = Directions {
            incoming: directions.outgoing,
            outgoing: directions.incoming,
        };
        let own = limits.check(&directions);
        let mut ways = Vec::new();
        if own.is_ok() {
            ways.push(Way {
                arms,
                swapped: false,
            });
        }
        if swap && limits.check(&exchanged).is_ok() {
            ways.push(Way {
                arms: arms.swapped(),
                swapped: true,
            });
        }
        match own {
            Err(why) if ways.is_empty() => missed.push(OutOfReach { index, arms, why }),
            _ => reached.push(Stop { index, ways }),
        }
    }
    match missed.is_empty() {
        true => Ok(reached),
        false => Err(missed),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NEURAL: &[u8] = include_bytes!("../../../core/examples/recipes/neural-n8.recipe");

    #[test]
    fn all_samples_out_of_reach_are_named_and_an_exchange_may_help() {
        let recipe = Recipe::parse(NEURAL).expect("it is a recipe");
        let limits = Limits {
            max_theta_o: 80_f32.to_radians(),
            ..Limits::NONE
        };
        let missed = stops(&recipe, &limits, false).expect_err("some are too low");
        let indices: Vec<usize> = missed.iter().map(|missed| missed.index).collect();
        assert_eq!(indices, [6, 7]);
        let first = recipe.out_of_reach(&limits).expect("the first one");
        assert_eq!((first.0, first.1), (6, missed[0].why));
        assert!(matches!(missed[0].why, Unreachable::ThetaO { .. }));
        let message = missed[0].to_string();
        for part in ["6", "56.90", "86.76", "max_theta_o"] {
            assert!(message.contains(part), "no {part} in {message}");
        }
        let stops = stops(&recipe, &limits, true).expect("the light gets there");
        let swapped = |index: usize| -> Vec<bool> {
            stops[index].ways.iter().map(|way| way.swapped).collect()
        };
        assert_eq!((swapped(5), swapped(6)), (vec![false, true], vec![true]));
    }
}
