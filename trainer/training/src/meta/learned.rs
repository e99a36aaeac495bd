//! The result of a training run: the content of a recipe.

use glimpse_core::fit::coefficient_net::MissingPolicy;
use glimpse_core::geometry::Angles;
use glimpse_core::model::ModelKind;
use glimpse_kernels::completion::Shape;
use glimpse_materials::Identity;

use super::correction::bounded_precision;
use super::expected_loss::ValidatedLoss;
use super::prior::loss_predictor::LossPredictor;
use crate::linear::ComponentsAt;

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
    /// The expected loss on an unseen material. None without a pattern: it depends on the directions.
    pub expected_loss: Option<ValidatedLoss>,
    /// The training materials, including those held out for validation.
    pub materials: Vec<Identity>,
}

/// A learned fit: the stages of an estimator.
#[derive(Clone, Debug, PartialEq)]
#[allow(clippy::large_enum_variant)] // a run has one
pub enum LearnedFit {
    /// SGD steps from learned parameters, for Phong, Cook-Torrance and Neural.
    Sgd(LearnedSgd),
    /// Coefficients.
    Ridge {
        /// The net before the ridge stage. None for the paper's Linear.
        net: Option<LearnedNet>,
        /// The ridge stage.
        ridge: LearnedRidge,
        /// The start and steps. None for Linear.
        refinement: Option<LearnedRefinement>,
    },
}

/// A Gaussian prior of the coefficients, and the components at the pattern.
#[derive(Clone, Debug, PartialEq)]
pub struct LearnedRidge {
    /// The mean of the mapped training columns at the pattern, n values.
    pub center: Vec<f32>,
    /// The components at the pattern, n rows of K values.
    pub rows: Vec<f32>,
    /// The precision of each component.
    pub precision: Vec<f32>,
    /// The precisions of the channels' differences from their mean, which has the other ones; empty if all channels have
    /// the same.
    pub difference_precision: Vec<f32>,
    /// The variance of a mapped reading's noise; None if it was not estimated.
    pub noise_variance: Option<f32>,
    /// The CRC-32 of the file of the whole basis; 0 without a file.
    pub basis_checksum: u32,
}

impl LearnedRidge {
    /// Creates the stage of a pattern.
    #[must_use]
    pub fn new(at: ComponentsAt, precision: &[f32], basis_checksum: u32) -> Self {
        Self {
            center: at.means(),
            precision: bounded_precision(&at.rows, precision),
            rows: at.rows,
            difference_precision: Vec::new(),
            noise_variance: None,
            basis_checksum,
        }
    }
}

/// SGD steps from learned parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct LearnedSgd {
    /// The model.
    pub model: ModelKind,
    /// The number of inner steps, K.
    pub steps: usize,
    /// The initial parameters, theta_0.
    pub initial: Vec<f32>,
    /// The step sizes, alpha, one per parameter.
    pub step_sizes: Vec<f32>,
}

/// A network from readings to coefficients of principal components (core's CoefficientNet).
#[derive(Clone, Debug, PartialEq)]
pub struct LearnedNet {
    /// The layer sizes of this network and of the StartNet.
    pub shape: Shape,
    /// The policy for missing readings used in training.
    pub missing: MissingPolicy,
    /// The scale of centered logarithms.
    pub scale: f32,
    /// The weights of all layers.
    pub weights: Vec<f32>,
}

/// Gauss-Newton steps, and the StartNet that offsets their initial parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct LearnedRefinement {
    /// The steps.
    pub steps: LearnedSteps,
    /// The layer sizes of the StartNet.
    pub shape: Shape,
    /// The weights of the StartNet.
    pub start_net: Vec<f32>,
}

/// Gauss-Newton steps toward virtual readings and those of the pattern.
#[derive(Clone, Debug, PartialEq)]
pub struct LearnedSteps {
    /// The model.
    pub model: ModelKind,
    /// The number of steps.
    pub steps: usize,
    /// The initial parameters, theta_0.
    pub initial: Vec<f32>,
    /// The precision of each active parameter of a system.
    pub precision: Vec<f32>,
    /// The sum of the weights of the pattern's readings.
    pub reading_weight: f32,
    /// The error at which the weight of a reading is halved.
    pub error_scale: f32,
    /// The directions of the virtual readings.
    pub directions: Vec<Angles<f32>>,
    /// The mean of the mapped training columns there.
    pub center: Vec<f32>,
    /// The components there: a row of m values for each direction.
    pub rows: Vec<f32>,
}
