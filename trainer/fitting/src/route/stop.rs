//! Positions of the arms for each sample of a recipe, and samples that they do not reach.

use glimpse_core::error::Error;
use glimpse_core::geometry::Arms;
use glimpse_core::gonio::Limits;
use glimpse_core::recipe::Recipe;
use glimpse_materials::setting::Name;

use super::arms::arms_in_degrees;
use super::machine::MachineError;

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

/// A request that no plan meets.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// The machine is invalid.
    #[error(transparent)]
    Machine(#[from] MachineError),
    /// Samples are out of the machine's reach.
    #[error(
        "the machine does not reach {} of {samples} samples:{}\ntrain a recipe for these limits ({}, {}, {})",
        missed.len(), missed.iter().map(|sample| format!("\n  {sample}")).collect::<String>(),
        Name::MAX_THETA_I, Name::MAX_THETA_O, Name::MIN_SEPARATION
    )]
    OutOfReach {
        /// These samples.
        missed: Vec<OutOfReach>,
        /// The number of samples of the recipe.
        samples: usize,
    },
}

/// Returns the directions of the arms in degrees at each sample: polar angles of 0 to 90, azimuths of -180 to 180.
///
/// # Errors
/// All unreachable samples.
pub fn stops(recipe: &Recipe<'_>, limits: &Limits) -> Result<Vec<Arms<f64>>, PlanError> {
    let mut stops = Vec::new();
    let mut missed = Vec::new();
    for (angles, (index, directions)) in recipe.pattern().zip(recipe.directions()) {
        let (index, arms) = (usize::from(index), arms_in_degrees(angles));
        match limits.check(&directions) {
            Ok(()) => stops.push(arms),
            Err(reason) => missed.push(OutOfReach {
                index,
                arms,
                reason,
            }),
        }
    }
    if missed.is_empty() {
        return Ok(stops);
    }
    let samples = recipe.samples();
    Err(PlanError::OutOfReach { missed, samples })
}
