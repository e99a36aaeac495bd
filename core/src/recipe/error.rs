//! Errors of a recipe.

use serde::{Deserialize, Serialize};

use super::field::Field;
use super::format::VERSION;
use super::kind::Kind;
use crate::error_code::ErrorCode;
use crate::gonio::LimitsError;
use crate::model::ModelKind;

/// An error in reading or writing a recipe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum RecipeError {
    /// The first four bytes are not `GLMP`.
    Magic,
    /// A format version that this crate does not read.
    Version(u16),
    /// The number of bytes is not that of the header.
    Length {
        /// Number of bytes of header and body, according to the header.
        expected: u32,
        /// Actual number of bytes.
        found: u32,
    },
    /// The bytes were altered after they were written.
    Checksum,
    /// The body does not follow the format, although its checksum is correct.
    Malformed,
    /// A field has an impossible number of entries, or an impossible count.
    Count(Field),
    /// The machine limits in the recipe are invalid.
    Limits(LimitsError),
    /// A field holds a NaN or an infinity.
    NonFinite(Field),
    /// A direction of the pattern's sample with this index is below the horizon.
    BelowHorizon(u16),
    /// The buffer for a recipe is too small.
    BufferTooSmall,
    /// The recipe has a descent or Gauss-Newton steps, which cannot fit this model.
    Model(ModelKind),
    /// A field that must be positive holds 0 or less.
    NotPositive(Field),
    /// A field that must not be negative holds a negative number.
    Negative(Field),
    /// A field holds a number outside of its [range](Field::range).
    Range(Field),
    /// A required section of an unknown kind.
    Unknown(Kind),
    /// A section follows one of the same or a higher kind.
    Order(Kind),
    /// The content of a section does not follow the format of its kind.
    Section(Kind),
    /// A section of this kind is missing.
    Missing(Kind),
    /// Number of fit methods: 0, or 2 for several. A recipe needs one: a descent, a ridge solve or a completion.
    Learners(u8),
    /// A copy must keep the section of this kind.
    Required(Kind),
    /// A section of this kind cannot be combined with a ridge solve.
    Beside(Kind),
    /// A field must be 0 or empty in a completion with a start or a correction, but is not.
    Unused(Field),
}

impl RecipeError {
    /// Returns the code.
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
            Self::Magic => f.write_str("this is not a recipe: it does not start with GLMP"),
            Self::Version(version) => {
                write!(
                    f,
                    "recipe format {version} is unknown, expected {VERSION}: train again, or \
                     build with the trainer's glimpse-core"
                )
            }
            Self::Length { expected, found } => {
                write!(
                    f,
                    "the recipe has {found} bytes instead of {expected}: it was cut or padded"
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
                    "the recipe has a descent or Gauss-Newton steps, which cannot fit {model}"
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
                let (min, max) = field.range();
                write!(
                    f,
                    "the recipe's field `{field}` holds a number outside of {min:e} to {max:e}"
                )
            }
            Self::Unknown(kind) => {
                write!(
                    f,
                    "the recipe's section {kind} is unknown: build glimpse-core with the features \
                     completion and ridge, or use a newer version"
                )
            }
            Self::Order(kind) => {
                write!(
                    f,
                    "the recipe's section {kind} occurs twice or follows a higher kind: \
                     kinds must ascend"
                )
            }
            Self::Section(kind) => {
                write!(f, "the recipe's section {kind} does not follow the format")
            }
            Self::Missing(kind) => write!(f, "the recipe has no section {kind}"),
            Self::Learners(count) => {
                write!(
                    f,
                    "the recipe has {count} fit methods, but needs one: a section {}, {} or {}",
                    Kind::DESCENT,
                    Kind::RIDGE,
                    Kind::COMPLETION
                )
            }
            Self::Required(kind) => {
                write!(
                    f,
                    "the recipe's section {kind} is required: omit only optional sections"
                )
            }
            Self::Beside(kind) => {
                write!(
                    f,
                    "the recipe's section {kind} cannot be combined with its section {}",
                    Kind::RIDGE
                )
            }
            Self::Unused(field) => {
                write!(
                    f,
                    "the recipe's field `{field}` has to be 0 or empty with a section {} or {}",
                    Kind::START,
                    Kind::CORRECTION
                )
            }
        }
    }
}

impl core::error::Error for RecipeError {}
