//! A complete training run, from materials to the content of a recipe.

use glimpse_core::recipe::{Contents, Pattern};
use glimpse_fitting::recipe::options::{Schedule, TrainingOptions};
use glimpse_fitting::recipe::sections::Arena;
use glimpse_fitting::recipe::{Metadata, RecipeFile, Training};
use glimpse_materials::{Identity, Material, SourceShare};

use crate::job::Job;
use crate::loss_predictor::LossPredictor;
use crate::outer::{Checkpoints, Session, StepObserver};
use crate::scan_budget::Motion;
use crate::{paper, prior};

pub use crate::paper::INNER_STEPS;
pub use crate::result::TrainError;

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
    /// The file of the basis, which accompanies a recipe of the model Linear.
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
    observer: &mut StepObserver<'_>,
) -> Result<TrainedRecipe, TrainError> {
    if materials.is_empty() {
        return Err(TrainError::NoMaterials);
    }
    check(options)?;
    check_source_shares(&options.source_shares, materials.len())?;
    let identities = Identity::list(&materials);
    // Run on a thread of the rayon pool: other threads would pass each parallel loop to the pool and wait.
    rayon::scope(|_| {
        let arena = Arena::default();
        let job = Job {
            arena: &arena,
            options,
            materials,
            session: Session::new(options.identity(&identities), checkpoints, observer),
        };
        let learned = match (options.schedule, options.samples) {
            (Schedule::Paper, _) => paper::train(job)?,
            (Schedule::Prior, 0) => prior::train_any(job)?,
            (Schedule::Prior, _) => prior::train(job)?,
        };
        let metadata = Metadata {
            expected_loss: learned.expected_loss,
            training: Some(Training::new(options, data, identities.len())),
            materials: identities,
        };
        let file = RecipeFile::write(&Contents {
            pattern: Some(Pattern {
                directions: arena.angles(&learned.pattern),
                is_path: options.scan_seconds.is_some(),
                expected_loss: metadata.expected_loss.map(|loss| loss.estimate.loss),
            }),
            prediction: (learned.loss_predictor.as_ref()).map(|loss| loss.section(&arena)),
            metadata: &metadata.to_bytes(),
            ..learned.fit
        })?;
        Ok(TrainedRecipe {
            file,
            basis: learned.basis,
            loss_predictor: learned.loss_predictor,
        })
    })
}

/// Checks that the sources cover all materials, and that all shares are positive and have the sum 1.
fn check_source_shares(source_shares: &[SourceShare], materials: usize) -> Result<(), TrainError> {
    let count: usize = source_shares.iter().map(|source| source.materials).sum();
    let sum: f32 = source_shares.iter().map(|source| source.share).sum();
    let is_positive = |source: &SourceShare| source.materials > 0 && source.share > 0.0;
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
