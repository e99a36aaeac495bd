//! The result of a training run: the content of a recipe.

use glimpse_core::geometry::Angles;
use glimpse_core::recipe::Contents;
use glimpse_fitting::recipe::expected_loss::ValidatedLoss;
use glimpse_materials::Identity;

use super::loss_predictor::LossPredictor;

/// The result of a training run.
pub(crate) struct Learned<'a> {
    /// The sample pattern. Both directions of each sample are above the horizon.
    pub(crate) pattern: Vec<Angles<f32>>,
    /// The stages of the fit.
    pub(crate) fit: Contents<'a>,
    /// The predictor of a material's loss. None for a recipe without completed readings, and for too few materials to
    /// form folds.
    pub(crate) loss_predictor: Option<LossPredictor>,
    /// The file of the full basis, which accompanies a recipe of the model Linear.
    pub(crate) basis: Option<Vec<u8>>,
    /// The expected loss on an unseen material. None without a pattern: it depends on the directions.
    pub(crate) expected_loss: Option<ValidatedLoss>,
    /// The training materials, including those held out for validation.
    pub(crate) materials: Vec<Identity>,
}
