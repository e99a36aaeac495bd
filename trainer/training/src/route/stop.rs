//! Positions of the arms for each sample of a recipe.

use glimpse_core::error::Error;
use glimpse_core::geometry::Arms;
use glimpse_core::gonio::Limits;
use glimpse_core::recipe::Recipe;

use super::arms::arms_in_degrees;

/// A sample and the position in which it is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// The sample's index in the recipe's pattern, from 0.
    pub index: usize,
    /// The directions of the arms in degrees: polar angles of 0 to 90, azimuths of -180 to 180.
    pub arms: Arms<f64>,
}

/// A sample that a machine cannot reach.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "sample {index} (theta_i {:.2}, phi_i {:.2}, theta_o {:.2}, phi_o {:.2} degrees): {reason}",
    arms.theta_i, arms.phi_i, arms.theta_o, arms.phi_o
)]
pub struct OutOfReach {
    /// The sample's index in the recipe's pattern, from 0.
    pub index: usize,
    /// The directions of the arms for this sample, in degrees.
    pub arms: Arms<f64>,
    /// The limit that is exceeded, and by how much.
    pub reason: Error,
}

/// Returns the recipe's samples, in the recipe's order.
///
/// # Errors
/// All unreachable samples.
pub fn stops(recipe: &Recipe<'_>, limits: &Limits) -> Result<Vec<Stop>, Vec<OutOfReach>> {
    let mut stops = Vec::new();
    let mut unreachable = Vec::new();
    for (angles, (index, directions)) in recipe.pattern().zip(recipe.directions()) {
        let (index, arms) = (usize::from(index), arms_in_degrees(angles));
        match limits.check(&directions) {
            Ok(()) => stops.push(Stop { index, arms }),
            Err(reason) => unreachable.push(OutOfReach {
                index,
                arms,
                reason,
            }),
        }
    }
    match unreachable.is_empty() {
        true => Ok(stops),
        false => Err(unreachable),
    }
}
