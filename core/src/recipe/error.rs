//! Why bytes are not a recipe.

use serde::{Deserialize, Serialize};

use super::{OLDEST_VERSION, VERSION};
use crate::model::ModelKind;

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
}

impl core::fmt::Display for Field {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
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
        })
    }
}

/// Why bytes are not a recipe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum RecipeError {
    /// The first four bytes are not `GLMP`.
    Magic,
    /// A format version that this crate does not read.
    Version(u16),
    /// The header promises more or fewer bytes than there are.
    Length {
        /// Bytes of header and body together, by the header.
        expected: u32,
        /// Bytes at hand.
        found: u32,
    },
    /// The bytes were altered after they were written.
    Checksum,
    /// The body does not follow the format, although its checksum is right.
    Malformed,
    /// A field has an impossible number of entries, or an impossible count.
    Count(Field),
    /// A field holds a NaN or an infinity.
    NonFinite(Field),
    /// A direction of the pattern's sample with this index is below the horizon.
    BelowHorizon(u16),
    /// The buffer given to [`Recipe::write`](super::Recipe::write) is too small.
    BufferTooSmall,
    /// This model is not fitted by descent.
    Model(ModelKind),
    /// A field holds 0 or less, where numbers have to be positive.
    NotPositive(Field),
    /// A field holds a negative number.
    Negative(Field),
}

impl core::fmt::Display for RecipeError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Magic => f.write_str("this is not a recipe: it does not begin with GLMP"),
            Self::Version(version) => {
                write!(
                    f,
                    "recipe format {version} is unknown: this reads formats {OLDEST_VERSION} to {VERSION}"
                )
            }
            Self::Length { expected, found } => {
                write!(
                    f,
                    "the recipe should have {expected} bytes but has {found}: it was cut or padded"
                )
            }
            Self::Checksum => f.write_str("the recipe's checksum is wrong: its bytes were altered"),
            Self::Malformed => f.write_str("the recipe's body does not follow the format"),
            Self::Count(field) => write!(f, "the recipe's field `{field}` has an impossible count"),
            Self::NonFinite(field) => {
                write!(f, "the recipe's field `{field}` holds a NaN or an infinity")
            }
            Self::BelowHorizon(index) => {
                write!(
                    f,
                    "sample {index} of the recipe's pattern has a direction below the horizon"
                )
            }
            Self::BufferTooSmall => f.write_str("the buffer is too small for the recipe"),
            Self::Model(model) => {
                write!(
                    f,
                    "the recipe is a descent, but {model} is not fitted by one"
                )
            }
            Self::NotPositive(field) => {
                write!(
                    f,
                    "the recipe's field `{field}` holds a number that is not positive"
                )
            }
            Self::Negative(field) => {
                write!(f, "the recipe's field `{field}` holds a negative number")
            }
        }
    }
}

impl core::error::Error for RecipeError {}
