//! What a training run ends in: all that a recipe holds.

use glimpse_core::fit::completion::Missing;
use glimpse_core::geometry::Angles;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::ValidationSplit;
use glimpse_kernels::completion::Shape;
use glimpse_materials::Identity;

use super::trainee::Expected;
use crate::linear::ReducedBasis;

/// What was learned.
#[derive(Clone, Debug, PartialEq)]
pub enum Learned {
    /// For a model that is fitted by descent.
    Descent(LearnedDescent),
    /// For the model Linear.
    Ridge(LearnedRidge),
    /// For any model, by schedule prior.
    Completed(Box<LearnedCompleted>),
}

/// What was learned for a model that is fitted by descent.
#[derive(Clone, Debug, PartialEq)]
pub struct LearnedDescent {
    /// The model.
    pub model: ModelKind,
    /// K.
    pub inner_steps: usize,
    /// Where to measure; both directions of each sample are above the horizon.
    pub pattern: Vec<Angles<f32>>,
    /// theta_0.
    pub initial: Vec<f32>,
    /// alpha.
    pub step_sizes: Vec<f32>,
    /// The loss to expect on an unseen material.
    pub expected_loss: ExpectedLoss,
    /// The materials that it was trained on, those held out for validation among them.
    pub materials: Vec<Identity>,
}

/// What was learned by schedule prior.
#[derive(Clone, Debug, PartialEq)]
pub struct LearnedCompleted {
    /// The model.
    pub model: ModelKind,
    /// Where to measure; both directions of each sample are above the horizon.
    pub pattern: Vec<Angles<f32>>,
    /// How large the completion is, and the start.
    pub shape: Shape,
    /// What it was trained to do where readings are missing.
    pub missing: Missing,
    /// What each sample's logarithm is centred by, n.
    pub centre: Vec<f32>,
    /// What it is multiplied by then.
    pub scale: f32,
    /// Weights of the completion.
    pub completion: Vec<f32>,
    /// What its coefficients become.
    pub target: LearnedTarget,
    /// What predicts the loss of a material's fit; None where there were too few materials to leave
    /// some out.
    pub prediction: Option<LearnedPrediction>,
    /// The loss to expect on an unseen material.
    pub expected_loss: ExpectedLoss,
    /// The materials that it was trained on, those held out for validation among them.
    pub materials: Vec<Identity>,
}

/// What predicts the loss of a material's fit.
#[derive(Clone, Debug, PartialEq)]
pub struct LearnedPrediction {
    /// A bias, and a weight for each coefficient, to the logarithm of the loss.
    pub weights: Vec<f32>,
    /// How well ones made alike rank materials of folds that they were not made from (Spearman), if they
    /// differ.
    pub rank_correlation: Option<f64>,
}

/// What coefficients become.
#[derive(Clone, Debug, PartialEq)]
pub enum LearnedTarget {
    /// The model Linear.
    Linear {
        /// The components at the pattern, n rows of m.
        rows: Vec<f32>,
        /// The file of the whole basis.
        basis: Vec<u8>,
    },
    /// Where a descent starts.
    Descent {
        /// K.
        inner_steps: usize,
        /// Phi.
        initial: Vec<f32>,
        /// alpha.
        step_sizes: Vec<f32>,
        /// Weights of the start.
        start: Vec<f32>,
    },
}

/// What was learned for the model Linear.
#[derive(Clone, Debug, PartialEq)]
pub struct LearnedRidge {
    /// The basis at the pattern.
    pub reduced: ReducedBasis,
    /// The file of the whole basis.
    pub basis: Vec<u8>,
    /// The loss to expect on an unseen material.
    pub expected_loss: ExpectedLoss,
    /// The materials that it was trained on.
    pub materials: Vec<Identity>,
}

/// The loss to expect on an unseen material, and the materials that it was found on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExpectedLoss {
    /// The loss.
    pub expected: Expected,
    /// The materials.
    pub split: ValidationSplit,
}

impl Learned {
    /// The loss to expect on an unseen material.
    #[must_use]
    pub fn expected_loss(&self) -> &ExpectedLoss {
        match self {
            Self::Descent(learned) => &learned.expected_loss,
            Self::Ridge(learned) => &learned.expected_loss,
            Self::Completed(learned) => &learned.expected_loss,
        }
    }

    /// The materials that it was trained on, those held out for validation among them.
    #[must_use]
    pub fn materials(&self) -> &[Identity] {
        match self {
            Self::Descent(learned) => &learned.materials,
            Self::Ridge(learned) => &learned.materials,
            Self::Completed(learned) => &learned.materials,
        }
    }

    /// How well materials are ranked by the losses that are predicted for them; see
    /// [`LearnedPrediction`].
    #[must_use]
    pub fn rank_correlation(&self) -> Option<f64> {
        match self {
            Self::Completed(learned) => learned.prediction.as_ref()?.rank_correlation,
            Self::Descent(_) | Self::Ridge(_) => None,
        }
    }

    /// The file of the whole basis that has to lie beside the recipe, for the model Linear.
    #[must_use]
    pub fn basis(&self) -> Option<&[u8]> {
        match self {
            Self::Ridge(learned) => Some(&learned.basis),
            Self::Completed(learned) => match &learned.target {
                LearnedTarget::Linear { basis, .. } => Some(basis),
                LearnedTarget::Descent { .. } => None,
            },
            Self::Descent(_) => None,
        }
    }
}
