//! A complete training run, from materials to the content of a recipe.

use glimpse_materials::{Material, SourceShare};

use super::checkpoint::CheckpointError;
use super::learned::LearnedRecipe;
use super::options::{OptionsError, Schedule, TrainingOptions};
use super::outer::{Checkpoints, Observer, RunError};
use super::scan_budget::{Motion, ScanBudgetError};
use super::{paper, prior};

pub use super::paper::INNER_STEPS;

/// The training ended without a result.
#[derive(Debug, thiserror::Error)]
pub enum TrainError {
    /// The list of materials is empty.
    #[error("the list of training materials is empty; name at least one material")]
    NoMaterials,
    /// The materials have no variances.
    #[error("the training materials are too few or all the same; give more of them")]
    TooFewMaterials,
    /// Source shares do not match the materials, or are not positive numbers with sum 1.
    #[error(
        "the source shares cover {source_shares} materials, but {materials} were given; list each source with its \
         number of materials and a share above 0, with a sum of 1"
    )]
    SourceShares {
        /// The number of materials of all sources.
        source_shares: usize,
        /// The number of materials.
        materials: usize,
    },
    /// The options are invalid.
    #[error(transparent)]
    Options(#[from] OptionsError),
    /// The budget for the time of a scan is impossible.
    #[error(transparent)]
    ScanBudget(#[from] ScanBudgetError),
    /// A checkpoint cannot be written or read.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// The observer stopped the run. With checkpoints, the state was saved.
    #[error("stopped after {0} outer steps")]
    Stopped(usize),
}

impl From<RunError> for TrainError {
    fn from(error: RunError) -> Self {
        match error {
            RunError::Checkpoint(error) => Self::Checkpoint(error),
            RunError::ScanBudget(error) => Self::ScanBudget(error),
            RunError::Stopped(done) => Self::Stopped(done),
        }
    }
}

/// Checks the options of a training, before its materials are loaded.
///
/// # Errors
/// [`TrainError::Options`] or [`TrainError::ScanBudget`].
pub fn check(options: &TrainingOptions) -> Result<(), TrainError> {
    options.validate()?;
    if let Some(motion) = Motion::of(options) {
        motion.validate()?;
    }
    Ok(())
}

/// Trains a recipe, calling `observer` after each outer step.
///
/// The result depends only on the options and the materials. The number of threads, and stopping and resuming, do not
/// change it. Without `checkpoints`, no state is saved.
///
/// # Errors
/// See [`TrainError`].
pub fn train(
    options: &TrainingOptions,
    materials: Vec<Box<dyn Material>>,
    checkpoints: Option<&Checkpoints>,
    observer: &mut Observer<'_>,
) -> Result<LearnedRecipe, TrainError> {
    if materials.is_empty() {
        return Err(TrainError::NoMaterials);
    }
    check(options)?;
    check_source_shares(&options.source_shares, materials.len())?;
    // Run on a thread of the rayon pool: other threads would pass each parallel loop to the pool and wait.
    rayon::scope(|_| match options.schedule {
        Schedule::Paper => Ok(paper::train(options, materials, checkpoints, observer)?),
        Schedule::Prior => {
            let learned = prior::train(options, materials, checkpoints, observer)?;
            learned.ok_or(TrainError::TooFewMaterials)
        }
    })
}

/// Checks that the sources cover all materials, and that all shares are positive and have the sum 1.
fn check_source_shares(source_shares: &[SourceShare], materials: usize) -> Result<(), TrainError> {
    let count: usize = source_shares
        .iter()
        .map(|source_share| source_share.materials)
        .sum();
    let sum: f32 = source_shares
        .iter()
        .map(|source_share| source_share.share)
        .sum();
    let is_positive =
        |source_share: &SourceShare| source_share.materials > 0 && source_share.share > 0.0;
    let is_valid =
        count == materials && (sum - 1.0).abs() < 1e-3 && source_shares.iter().all(is_positive);
    if is_valid || source_shares.is_empty() {
        return Ok(());
    }
    Err(TrainError::SourceShares {
        source_shares: count,
        materials,
    })
}
