//! The result of a training run: the content of a recipe, or an error.

use glimpse_core::geometry::Angles;
use glimpse_core::recipe::Contents;
use glimpse_fitting::recipe::RecipeDefect;
use glimpse_fitting::recipe::expected_loss::ValidatedLoss;
use glimpse_fitting::recipe::options::OptionsError;

use super::checkpoint::CheckpointError;
use super::loss_predictor::LossPredictor;
use super::scan_budget::ScanBudgetError;

/// The result of a training run.
#[derive(Default)]
pub(crate) struct Learned<'a> {
    /// The sample pattern. Both directions of each sample are above the horizon.
    pub(crate) pattern: Vec<Angles<f32>>,
    /// The stages of the fit, without the pattern.
    pub(crate) fit: Contents<'a>,
    /// The predictor of a material's loss. None for a recipe without completed readings, and for too few materials to
    /// form folds.
    pub(crate) loss_predictor: Option<LossPredictor>,
    /// The file of the basis, which accompanies a recipe of the model Linear.
    pub(crate) basis: Option<Vec<u8>>,
    /// The expected loss on an unseen material. None without a pattern: it depends on the directions.
    pub(crate) expected_loss: Option<ValidatedLoss>,
}

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
