//! Errors of a recipe.

use super::field::Field;
use super::format::VERSION;
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
        let section = |kind: Kind| Self::with(ErrorCode::RecipeSections, [kind.number().into(), 0]);
        let in_field = |code, field: Field| Self {
            field: field.name(),
            ..Self::new(code)
        };
        match error {
            RecipeError::Magic => Self::new(ErrorCode::RecipeMagic),
            RecipeError::Version(version) => {
                Self::with(ErrorCode::RecipeVersion, [version.into(), 0])
            }
            RecipeError::Length { expected, found } => {
                Self::with(ErrorCode::RecipeLength, [expected, found])
            }
            RecipeError::Checksum => Self::new(ErrorCode::RecipeChecksum),
            RecipeError::Malformed => Self::new(ErrorCode::RecipeMalformed),
            RecipeError::Count(field) => in_field(ErrorCode::RecipeCount, field),
            RecipeError::Limits(error) => error,
            RecipeError::NonFinite(field) => in_field(ErrorCode::RecipeNonFinite, field),
            RecipeError::BelowHorizon(index) => {
                Self::with(ErrorCode::RecipeBelowHorizon, [index.into(), 0])
            }
            RecipeError::Model(model) => Self::with(ErrorCode::RecipeModel, [model as u32, 0]),
            RecipeError::NotPositive(field) => in_field(ErrorCode::RecipeNotPositive, field),
            RecipeError::Negative(field) => in_field(ErrorCode::RecipeNegative, field),
            RecipeError::Range(field) => in_field(ErrorCode::RecipeRange, field),
            RecipeError::Unknown(kind) => {
                Self::with(ErrorCode::RecipeUnknown, [kind.number().into(), 0])
            }
            RecipeError::BufferTooSmall => Self::new(ErrorCode::BufferTooSmall),
            RecipeError::Learners(_) => Self::new(ErrorCode::RecipeSections),
            RecipeError::Unused(field) => in_field(ErrorCode::RecipeSections, field),
            RecipeError::Order(kind)
            | RecipeError::Section(kind)
            | RecipeError::Missing(kind)
            | RecipeError::Required(kind)
            | RecipeError::Beside(kind) => section(kind),
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
