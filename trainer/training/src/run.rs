//! A complete training run, from materials to the content of a recipe.

use glimpse_core::recipe::{Contents, Pattern};
use glimpse_fitting::recipe::options::{OptionsError, Schedule, TrainingOptions};
use glimpse_fitting::recipe::sections::Arena;
use glimpse_fitting::recipe::{Metadata, RecipeDefect, RecipeFile, Training};
use glimpse_materials::{Material, SourceShare};

use crate::checkpoint::CheckpointError;
use crate::learned::Learned;
use crate::loss_predictor::LossPredictor;
use crate::outer::{Checkpoints, Observer, RunError};
use crate::scan_budget::{Motion, ScanBudgetError};
use crate::{paper, prior};

pub use crate::paper::INNER_STEPS;

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
    /// The result is not a valid recipe, for example because a number is not finite.
    #[error(
        "training did not converge to a valid recipe; train with another seed or with more materials"
    )]
    Diverged(#[from] RecipeDefect),
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

/// A trained recipe.
#[derive(Debug)]
pub struct TrainedRecipe {
    /// The recipe.
    pub file: RecipeFile,
    /// The file of the full basis, which accompanies a recipe of the model Linear.
    pub basis: Option<Vec<u8>>,
    /// The predictor of a material's loss. None for a recipe without completed readings, and for too few materials to
    /// form folds.
    pub loss_predictor: Option<LossPredictor>,
}

/// Trains a recipe on materials with the name `data`, calling `observer` after each outer step.
///
/// The result depends only on the options and the materials. The number of threads, and stopping and resuming, do not
/// change it. Without `checkpoints`, no state is saved.
///
/// # Errors
/// See [`TrainError`].
pub fn train(
    options: &TrainingOptions,
    data: &str,
    materials: Vec<Box<dyn Material>>,
    checkpoints: Option<&Checkpoints>,
    observer: &mut Observer<'_>,
) -> Result<TrainedRecipe, TrainError> {
    if materials.is_empty() {
        return Err(TrainError::NoMaterials);
    }
    check(options)?;
    check_source_shares(&options.source_shares, materials.len())?;
    // Run on a thread of the rayon pool: other threads would pass each parallel loop to the pool and wait.
    rayon::scope(|_| {
        let arena = Arena::default();
        let learned = match options.schedule {
            Schedule::Paper => paper::train(&arena, options, materials, checkpoints, observer)?,
            Schedule::Prior => prior::train(&arena, options, materials, checkpoints, observer)?
                .ok_or(TrainError::TooFewMaterials)?,
        };
        Ok(TrainedRecipe {
            file: write(&arena, &learned, options, data)?,
            basis: learned.basis,
            loss_predictor: learned.loss_predictor,
        })
    })
}

/// Writes a recipe with its pattern, prediction and metadata.
fn write(
    arena: &Arena,
    learned: &Learned<'_>,
    options: &TrainingOptions,
    data: &str,
) -> Result<RecipeFile, RecipeDefect> {
    let metadata = Metadata {
        expected_loss: learned.expected_loss,
        training: Some(Training::new(options, data, learned.materials.len())),
        materials: learned.materials.clone(),
    };
    let predictor = learned.loss_predictor.as_ref();
    RecipeFile::write(&Contents {
        pattern: Some(Pattern {
            directions: arena.angles(&learned.pattern),
            is_path: options.scan_seconds.is_some(),
            expected_loss: learned.expected_loss.map(|expected| expected.estimate.loss),
        }),
        prediction: predictor.map(|predictor| predictor.section(arena)),
        metadata: &metadata.to_bytes(),
        ..learned.fit
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
