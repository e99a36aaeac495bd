//! The fields of a recipe, to name them in errors.

use serde::{Deserialize, Serialize};

use super::format::{
    MAX_BASIS, MAX_MEAN, MAX_MEDIAN, MAX_PRECISION, MAX_PREDICTION, MAX_WEIGHT, MIN_PRECISION,
};

/// A field of the recipe, to name it in errors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Field {
    /// The body as a whole.
    Body,
    /// SGD steps.
    InnerSteps,
    /// Where to measure.
    Pattern,
    /// Initial parameters.
    Initial,
    /// A step size for each parameter.
    StepSizes,
    /// The loss to expect.
    ExpectedLoss,
    /// m, the number of components.
    Components,
    /// The components at the sampled directions.
    Basis,
    /// The mean at the sampled directions.
    Mean,
    /// The median at the sampled directions.
    Median,
    /// The weights of the sampled directions.
    Weight,
    /// The precision of each coefficient.
    Precision,
    /// The standard error of the loss to expect.
    StandardError,
    /// Noise relative to the value.
    Multiplicative,
    /// Noise that does not depend on the value.
    Additive,
    /// Weights of a learned map.
    Weights,
    /// Biases of a learned map.
    Bias,
    /// What weights, or readings, are to be multiplied by.
    Scale,
    /// From coefficients to the loss that a fit is likely to have.
    Prediction,
}

impl Field {
    /// The name, as in `core/docs/recipe.md`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Body => "body",
            Self::InnerSteps => "inner_steps",
            Self::Pattern => "pattern",
            Self::Initial => "initial",
            Self::StepSizes => "step_sizes",
            Self::ExpectedLoss => "expected_loss",
            Self::Components => "components",
            Self::Basis => "basis",
            Self::Mean => "mean",
            Self::Median => "median",
            Self::Weight => "weight",
            Self::Precision => "precision",
            Self::StandardError => "standard_error",
            Self::Multiplicative => "multiplicative",
            Self::Additive => "additive",
            Self::Weights => "weights",
            Self::Bias => "bias",
            Self::Scale => "scale",
            Self::Prediction => "prediction",
        }
    }

    /// The smallest and the largest number that it may hold; all finite ones where nothing else is
    /// said.
    #[must_use]
    pub const fn range(self) -> (f32, f32) {
        match self {
            Self::Basis => (-MAX_BASIS, MAX_BASIS),
            Self::Prediction => (-MAX_PREDICTION, MAX_PREDICTION),
            Self::Mean => (-MAX_MEAN, MAX_MEAN),
            Self::Median => (0.0, MAX_MEDIAN),
            Self::Weight => (0.0, MAX_WEIGHT),
            Self::Precision => (MIN_PRECISION, MAX_PRECISION),
            Self::StandardError | Self::Multiplicative | Self::Additive => (0.0, f32::MAX),
            _ => (f32::MIN, f32::MAX),
        }
    }
}

impl core::fmt::Display for Field {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name())
    }
}
