//! The result of a training run: everything that a recipe holds.

use glimpse_core::fit::coefficient_net::MissingPolicy;
use glimpse_core::geometry::Angles;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::ValidationSplit;
use glimpse_kernels::completion::Shape;
use glimpse_materials::Identity;

use super::completion::loss_predictor::LossPredictor;
use super::objective::Expected;
use crate::linear::ReducedBasis;

/// The result of a training run.
#[derive(Clone, Debug, PartialEq)]
pub struct Learned {
    /// The sample directions; both directions of each sample are above the horizon.
    pub pattern: Vec<Angles<f32>>,
    /// The fit from readings at those directions.
    pub fit: LearnedFit,
    /// The predictor of the loss of a material's fit. None for a recipe that does not complete
    /// readings, and for too few materials to leave some out.
    pub prediction: Option<LossPredictor>,
    /// The file of the whole basis, which belongs beside a recipe of the model Linear.
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
    Ridge(ReducedBasis),
    /// A completion to coefficients, for any model by schedule prior.
    Completed(LearnedCompletion, CompletionTarget),
}

/// SGD steps from learned parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct LearnedDescent {
    /// The model.
    pub model: ModelKind,
    /// K, the number of steps.
    pub inner_steps: usize,
    /// theta_0.
    pub initial: Vec<f32>,
    /// alpha, one for each parameter.
    pub step_sizes: Vec<f32>,
}

/// A network from readings to coefficients of principal components.
#[derive(Clone, Debug, PartialEq)]
pub struct LearnedCompletion {
    /// The sizes of its layers, and of those of the start.
    pub shape: Shape,
    /// The policy for missing readings that it was trained with.
    pub missing: MissingPolicy,
    /// The center of each sample's logarithm, n.
    pub center: Vec<f32>,
    /// The factor on centered logarithms.
    pub scale: f32,
    /// Weights.
    pub weights: Vec<f32>,
}

/// Use of a completion's coefficients.
#[derive(Clone, Debug, PartialEq)]
pub enum CompletionTarget {
    /// They are the coefficients of the model Linear.
    Linear {
        /// The components at the pattern, n rows of m.
        rows: Vec<f32>,
        /// The CRC-32 of the file of the whole basis.
        basis_checksum: u32,
    },
    /// They choose the start of a descent, by a network with these weights.
    Descent(LearnedDescent, Vec<f32>),
}

/// The expected loss on an unseen material, and the materials that it was measured on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ValidatedLoss {
    /// The loss.
    pub expected: Expected,
    /// The materials.
    pub split: ValidationSplit,
}
