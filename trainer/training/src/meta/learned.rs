//! The result of a training run: the content of a recipe.

use glimpse_core::fit::coefficient_net::MissingPolicy;
use glimpse_core::geometry::Angles;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::ValidationSplit;
use glimpse_kernels::completion::Shape;
use glimpse_materials::Identity;

use super::completion::loss_predictor::LossPredictor;
use super::objective::LossEstimate;
use crate::linear::RecipeBasis;

/// The result of a training run.
#[derive(Clone, Debug, PartialEq)]
pub struct LearnedRecipe {
    /// The sample pattern. Both directions of each sample are above the horizon.
    pub pattern: Vec<Angles<f32>>,
    /// The fit from readings at those directions.
    pub fit: LearnedFit,
    /// The predictor of a material's loss. None for a recipe without completed readings, and for too few materials to
    /// form folds.
    pub loss_predictor: Option<LossPredictor>,
    /// The file of the full basis, which accompanies a recipe of the model Linear.
    pub basis: Option<Vec<u8>>,
    /// The expected loss on an unseen material.
    pub expected_loss: ValidatedLoss,
    /// The training materials, including those held out for validation.
    pub materials: Vec<Identity>,
}

/// A learned fit.
#[derive(Clone, Debug, PartialEq)]
pub enum LearnedFit {
    /// SGD steps from learned parameters, for Phong, Cook-Torrance and Neural.
    Descent(LearnedDescent),
    /// A ridge solve, for Linear.
    Ridge(RecipeBasis),
    /// Completed coefficients, for any model with `--schedule prior`.
    Completed(LearnedCoefficientNet, CompletionTarget),
}

/// SGD steps from learned parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct LearnedDescent {
    /// The model.
    pub model: ModelKind,
    /// The number of inner steps, K.
    pub inner_steps: usize,
    /// The initial parameters, theta_0.
    pub initial: Vec<f32>,
    /// The step sizes, alpha, one per parameter.
    pub step_sizes: Vec<f32>,
}

/// A network from readings to coefficients of principal components (core's CoefficientNet).
#[derive(Clone, Debug, PartialEq)]
pub struct LearnedCoefficientNet {
    /// The layer sizes of this network and of the InitNet.
    pub shape: Shape,
    /// The policy for missing readings used in training.
    pub missing: MissingPolicy,
    /// The mean of each sample's logarithm, n values.
    pub center: Vec<f32>,
    /// The scale of centered logarithms.
    pub scale: f32,
    /// The weights of all layers.
    pub weights: Vec<f32>,
}

/// The use of completed coefficients.
#[derive(Clone, Debug, PartialEq)]
pub enum CompletionTarget {
    /// Coefficients of the model Linear.
    Linear {
        /// The components at the pattern, n rows of m values.
        rows: Vec<f32>,
        /// The CRC-32 of the file of the whole basis.
        basis_checksum: u32,
    },
    /// Inputs of an InitNet with these weights, which offsets the initial parameters of a descent.
    Descent(LearnedDescent, Vec<f32>),
}

/// The expected loss on an unseen material, and the materials it was estimated on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ValidatedLoss {
    /// The estimate.
    pub estimate: LossEstimate,
    /// The materials.
    pub split: ValidationSplit,
}
