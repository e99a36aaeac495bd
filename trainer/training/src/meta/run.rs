//! A complete training run, from materials to the content of a recipe.

use glimpse_core::section::MAX_SAMPLES;
use glimpse_materials::{Material, SourceShare};

use super::checkpoint::CheckpointError;
use super::learned::LearnedRecipe;
use super::options::{Options, OptionsError};
use super::outer::{Observer, RunError};
use super::plan::{Schedule, TrainedParts};
use super::scan_budget::ScanBudgetError;
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
    /// The number of samples, n, is out of range.
    #[error("the number of samples is {0}; choose 1 to {max}, or any with the schedule prior", max = MAX_SAMPLES)]
    Samples(usize),
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
    /// Schedule prior trains all parts, and Linear has nothing to train without a pattern.
    #[error("the parts \"{}\" cannot be trained with these options; choose \"all\"", .0.name())]
    Parts(TrainedParts),
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

/// Trains a recipe, calling `observer` after each outer step.
///
/// The result depends only on the options and the materials. The number of threads, and stopping and resuming, do not
/// change it.
///
/// # Errors
/// See [`TrainError`].
pub fn train(
    options: &Options,
    materials: Vec<Box<dyn Material>>,
    observer: &mut Observer<'_>,
) -> Result<LearnedRecipe, TrainError> {
    if materials.is_empty() {
        return Err(TrainError::NoMaterials);
    }
    let is_any = options.samples == 0 && options.schedule == Schedule::Prior;
    if !is_any && !(1..=MAX_SAMPLES).contains(&options.samples) {
        return Err(TrainError::Samples(options.samples));
    }
    if options.schedule == Schedule::Prior && options.parts != TrainedParts::All {
        return Err(TrainError::Parts(options.parts));
    }
    options.completion_options.validate(options.samples)?;
    check_source_shares(&options.source_shares, materials.len())?;
    // Run on a thread of the rayon pool: other threads would pass each parallel loop to the pool and wait.
    rayon::scope(|_| match options.schedule {
        Schedule::Paper => Ok(paper::train(options, materials, observer)?),
        Schedule::Prior if is_any => {
            let learned = prior::train_at_any_directions(options, materials, observer)?;
            learned.ok_or(TrainError::TooFewMaterials)
        }
        Schedule::Prior => Ok(prior::train(options, materials, observer)?),
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
