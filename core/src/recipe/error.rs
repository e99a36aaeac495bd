//! Errors of a recipe.

use super::field::Field;
use super::kind::Kind;
use crate::error::{Error, ErrorCode};
use crate::model::ModelKind;

/// An error in reading or writing a recipe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
    Limits(Error),
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

impl From<RecipeError> for Error {
    fn from(error: RecipeError) -> Self {
        use ErrorCode as Code;
        let (code, field, details) = match error {
            RecipeError::Magic => (Code::RecipeMagic, "", [0; 2]),
            RecipeError::Version(version) => (Code::RecipeVersion, "", [version.into(), 0]),
            RecipeError::Length { expected, found } => (Code::RecipeLength, "", [expected, found]),
            RecipeError::Checksum => (Code::RecipeChecksum, "", [0; 2]),
            RecipeError::Malformed => (Code::RecipeMalformed, "", [0; 2]),
            RecipeError::Count(field) => (Code::RecipeCount, field.name(), [0; 2]),
            RecipeError::Limits(error) => return error,
            RecipeError::NonFinite(field) => (Code::RecipeNonFinite, field.name(), [0; 2]),
            RecipeError::BelowHorizon(index) => (Code::RecipeBelowHorizon, "", [index.into(), 0]),
            RecipeError::BufferTooSmall => (Code::BufferTooSmall, "", [0; 2]),
            RecipeError::Model(model) => (Code::RecipeModel, "", [model as u32, 0]),
            RecipeError::NotPositive(field) => (Code::RecipeNotPositive, field.name(), [0; 2]),
            RecipeError::Negative(field) => (Code::RecipeNegative, field.name(), [0; 2]),
            RecipeError::Range(field) => (Code::RecipeRange, field.name(), [0; 2]),
            RecipeError::Unknown(kind) => (Code::RecipeUnknown, "", [kind.number().into(), 0]),
            RecipeError::Learners(_) => (Code::RecipeSections, "", [0; 2]),
            RecipeError::Unused(field) => (Code::RecipeSections, field.name(), [0; 2]),
            RecipeError::Order(kind)
            | RecipeError::Section(kind)
            | RecipeError::Missing(kind)
            | RecipeError::Required(kind)
            | RecipeError::Beside(kind) => {
                let name = kind.name().unwrap_or_default();
                (Code::RecipeSections, name, [kind.number().into(), 0])
            }
        };
        Self {
            code,
            field,
            details,
        }
    }
}

impl core::fmt::Display for RecipeError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        Error::from(*self).fmt(f)
    }
}

impl core::error::Error for RecipeError {}
