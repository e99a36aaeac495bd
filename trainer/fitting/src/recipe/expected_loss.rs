//! The expected loss of a recipe on an unseen material.

use serde::{Deserialize, Serialize};

/// An estimate of the loss on an unseen material.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LossEstimate {
    /// The mean loss.
    pub loss: f32,
    /// The standard error of the mean; None for a single material.
    pub standard_error: Option<f32>,
    /// The number of materials.
    pub materials: usize,
}

impl LossEstimate {
    /// Creates an estimate from the losses of single materials.
    #[must_use]
    pub fn of(losses: &[f32]) -> Self {
        let mean = losses.iter().sum::<f32>() / losses.len() as f32;
        Self::new(mean, losses.iter().copied().map(f64::from))
    }

    /// Creates an estimate from a mean loss and the losses of single materials.
    #[must_use]
    pub fn new(loss: f32, losses: impl ExactSizeIterator<Item = f64> + Clone) -> Self {
        let count = losses.len() as f64;
        let mean = losses.clone().sum::<f64>() / count;
        let squares: f64 = losses.map(|loss| (loss - mean).powi(2)).sum();
        let variance_of_mean = squares / (count - 1.0) / count;
        Self {
            loss,
            standard_error: (count > 1.0).then(|| variance_of_mean.sqrt() as f32),
            materials: count as usize,
        }
    }
}

/// The expected loss on an unseen material, and the materials it was estimated on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ValidatedLoss {
    /// The estimate.
    pub estimate: LossEstimate,
    /// The materials.
    pub split: ValidationSplit,
}

/// The materials of an expected loss.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ValidationSplit {
    /// Materials held out of training.
    HeldOut,
    /// The training materials. Their loss does not predict that of other materials.
    Training,
    /// The training materials, each with a basis of the others.
    LeftOut,
    /// The training materials, each by a training without its fold.
    Folds,
}

impl ValidationSplit {
    /// Describes the materials in words that follow "materials of" and a source.
    #[must_use]
    pub const fn description(self) -> &'static str {
        match self {
            Self::HeldOut => "held out of training",
            Self::Training => "that it was trained on",
            Self::LeftOut => "that it was trained on, each with a basis of others",
            Self::Folds => "that it was trained on, each by what was trained without it",
        }
    }
}
