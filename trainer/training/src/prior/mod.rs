//! Schedule prior: a CoefficientNet maps readings to coefficients of principal components, and is trained jointly with the
//! pattern.
//!
//! For the model Linear, the loss is that of the coefficients. For other models, a StartNet maps the coefficients to
//! initial parameters, and the loss is that of the parameters after the [refinement]. Without a pattern, the coefficients
//! are those of a ridge fit at any directions.

mod any_directions;
mod completed_tasks;
pub mod dataset;
mod folds;
mod gradient;
mod held_out;
mod hyperparameters;
mod initial_weights;
pub mod objective;
pub mod phases;
pub mod refinement;
mod sample_order;
mod train;
mod virtual_readings;

use glimpse_fitting::recipe::options::TrainingOptions;
use glimpse_fitting::recipe::sections::Arena;
use glimpse_materials::Material;

use super::learned::Learned;
use super::outer::{Checkpoints, Observer, RunError};

/// Trains a recipe. None if the materials of a recipe without a pattern are too few, or all the same.
///
/// # Errors
/// If the run is stopped, or a checkpoint cannot be read or written.
pub(crate) fn train<'a>(
    arena: &'a Arena,
    options: &TrainingOptions,
    materials: Vec<Box<dyn Material>>,
    checkpoints: Option<&Checkpoints>,
    observer: &mut Observer<'_>,
) -> Result<Option<Learned<'a>>, RunError> {
    if options.samples == 0 {
        any_directions::train(arena, options, materials, checkpoints, observer)
    } else {
        train::train(arena, options, materials, checkpoints, observer).map(Some)
    }
}
