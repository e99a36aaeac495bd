//! Errors of a recipe.

use serde::{Deserialize, Serialize};

use super::field::Field;
use super::format::VERSION;
use super::kind::Kind;
use crate::error_code::ErrorCode;
use crate::gonio::LimitsError;
use crate::model::ModelKind;

/// Errors of a recipe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
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
    /// The limits that it states are none.
    Limits(LimitsError),
    /// A field holds a NaN or an infinity.
    NonFinite(Field),
    /// A direction of the pattern's sample with this index is below the horizon.
    BelowHorizon(u16),
    /// The buffer for a recipe is too small.
    BufferTooSmall,
    /// This model is not fitted by descent.
    Model(ModelKind),
    /// A field holds 0 or less, where numbers have to be positive.
    NotPositive(Field),
    /// A field holds a negative number.
    Negative(Field),
    /// A field holds a number outside of its [range](Field::range).
    Range(Field),
    /// A section that this crate does not know, and that the recipe cannot be read without.
    Unknown(Kind),
    /// A section stands behind one of the same or a higher kind.
    Order(Kind),
    /// What is in a section does not follow the format of its kind.
    Section(Kind),
    /// There is no section of this kind.
    Missing(Kind),
    /// So many learners, where one is needed: a descent, a ridge solve or a completion.
    Learners(u8),
    /// A copy cannot be without a section of this kind.
    Required(Kind),
    /// A section of this kind, which does not go with a ridge solve.
    Beside(Kind),
    /// A field that is for a completion by itself, and not 0 or empty beside a start.
    Unused(Field),
}

impl RecipeError {
    /// The code.
    #[must_use]
    pub const fn code(&self) -> ErrorCode {
        match self {
            Self::Magic => ErrorCode::RecipeMagic,
            Self::Version(_) => ErrorCode::RecipeVersion,
            Self::Length { .. } => ErrorCode::RecipeLength,
            Self::Checksum => ErrorCode::RecipeChecksum,
            Self::Malformed => ErrorCode::RecipeMalformed,
            Self::Count(_) => ErrorCode::RecipeCount,
            Self::Limits(_) => ErrorCode::RecipeLimits,
            Self::NonFinite(_) => ErrorCode::RecipeNonFinite,
            Self::BelowHorizon(_) => ErrorCode::RecipeBelowHorizon,
            Self::Model(_) => ErrorCode::RecipeModel,
            Self::NotPositive(_) => ErrorCode::RecipeNotPositive,
            Self::Negative(_) => ErrorCode::RecipeNegative,
            Self::Range(_) => ErrorCode::RecipeRange,
            Self::Unknown(_) => ErrorCode::RecipeUnknown,
            Self::BufferTooSmall => ErrorCode::BufferTooSmall,
            Self::Order(_)
            | Self::Section(_)
            | Self::Missing(_)
            | Self::Learners(_)
            | Self::Required(_)
            | Self::Beside(_)
            | Self::Unused(_) => ErrorCode::RecipeSections,
        }
    }
}

impl core::fmt::Display for RecipeError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Magic => f.write_str("this is not a recipe: it does not begin with GLMP"),
            Self::Version(version) => {
                write!(
                    f,
                    "recipe format {version} is unknown: this reads format {VERSION}; train \
                     again, or build with the glimpse-core of the trainer"
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
            Self::Limits(error) => error.fmt(f),
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
            Self::Range(field) => {
                let (least, most) = field.range();
                write!(
                    f,
                    "the recipe's field `{field}` holds a number that is not within {least:e} to {most:e}"
                )
            }
            Self::Unknown(kind) => {
                write!(
                    f,
                    "the recipe's section {kind} is unknown here: \
                     build with glimpse-core's features completion and ridge, or with a newer version"
                )
            }
            Self::Order(kind) => {
                write!(
                    f,
                    "the recipe's section {kind} is there twice, or behind one of a higher kind: \
                     kinds ascend"
                )
            }
            Self::Section(kind) => {
                write!(f, "the recipe's section {kind} does not follow the format")
            }
            Self::Missing(kind) => write!(f, "the recipe lacks its section {kind}"),
            Self::Learners(found) => {
                write!(
                    f,
                    "the recipe has {found} learners, but needs one: a section {}, {} or {}",
                    Kind::DESCENT,
                    Kind::RIDGE,
                    Kind::COMPLETION
                )
            }
            Self::Required(kind) => {
                write!(
                    f,
                    "a recipe cannot be without its section {kind}: only optional ones are left out"
                )
            }
            Self::Beside(kind) => {
                write!(
                    f,
                    "the recipe's section {kind} does not go with its section {}, a method by itself",
                    Kind::RIDGE
                )
            }
            Self::Unused(field) => {
                write!(
                    f,
                    "the recipe's field `{field}` has to be 0 or empty beside its section {}",
                    Kind::START
                )
            }
        }
    }
}

impl core::error::Error for RecipeError {}
