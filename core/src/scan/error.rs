//! Errors of a scan.

use serde::{Deserialize, Serialize};

use super::implausible::Implausible;
use crate::error_code::ErrorCode;
use crate::fit::{ModelMismatch, Progress};
use crate::model::ModelKind;

/// Errors before a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ScanError {
    /// The recipe is for another model than this firmware's.
    Model {
        /// The firmware's model.
        firmware: ModelKind,
        /// The recipe's model.
        recipe: ModelKind,
    },
    /// The recipe takes more memory than this firmware gives it.
    Memory {
        /// Words (of 4 bytes) that it takes.
        needed: usize,
        /// Words that there are.
        found: usize,
    },
    /// The basis is not the one that the recipe names.
    Basis {
        /// The checksum that the recipe names; None if it needs no basis.
        recipe: Option<u32>,
        /// The checksum that the basis was made from.
        found: u32,
    },
}

impl From<ModelMismatch> for ScanError {
    fn from(ModelMismatch { firmware, recipe }: ModelMismatch) -> Self {
        Self::Model { firmware, recipe }
    }
}

impl ScanError {
    /// The code.
    #[must_use]
    pub const fn code(&self) -> ErrorCode {
        match self {
            Self::Model { .. } => ErrorCode::Model,
            Self::Memory { .. } => ErrorCode::Memory,
            Self::Basis { .. } => ErrorCode::Basis,
        }
    }
}

impl core::fmt::Display for ScanError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Model { firmware, recipe } => write!(
                f,
                "the recipe is for the model {recipe}, this firmware fits {firmware}: name another model in it, or train for this one"
            ),
            Self::Memory { needed, found } => write!(
                f,
                "the recipe needs a memory of {needed} words, this one has {found}: compute its length with `recipe::memory_words`"
            ),
            Self::Basis {
                recipe: Some(recipe),
                found,
            } => write!(
                f,
                "the recipe names the basis {recipe:08x}, this one was made from {found:08x}: export the recipe's own"
            ),
            Self::Basis { recipe: None, .. } => {
                f.write_str("the recipe needs no basis: remove `with_basis`")
            }
        }
    }
}

impl core::error::Error for ScanError {}

/// Errors of a skipped sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SkipError {
    /// The recipe does not tolerate missing readings.
    Required,
    /// The recipe's pattern has no sample with this index.
    Index {
        /// The index.
        index: u16,
        /// Number of samples of the recipe.
        samples: u16,
    },
}

impl SkipError {
    /// The code.
    #[must_use]
    pub const fn code(&self) -> ErrorCode {
        match self {
            Self::Required => ErrorCode::ReadingRequired,
            Self::Index { .. } => ErrorCode::ReadingIndex,
        }
    }
}

impl core::fmt::Display for SkipError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Required => f.write_str(
                "the recipe needs every reading: train one with `--missing` to skip samples",
            ),
            Self::Index { index, samples } => {
                write!(f, "there is no sample {index}: the pattern has {samples}")
            }
        }
    }
}

impl core::error::Error for SkipError {}

/// Errors before a fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum FitError {
    /// Not all readings are taken, and the recipe cannot do without.
    Incomplete {
        /// Number of missing readings.
        missing: u16,
        /// The index of the first of them.
        first: u16,
    },
    /// More than three quarters of the readings are larger than this, in sr^-1: they are counts, or are not
    /// divided by the white.
    TooLarge {
        /// The limit, sr^-1.
        limit: u16,
    },
}

impl FitError {
    /// The code.
    #[must_use]
    pub const fn code(&self) -> ErrorCode {
        match self {
            Self::Incomplete { .. } => ErrorCode::Incomplete,
            Self::TooLarge { .. } => ErrorCode::TooLarge,
        }
    }
}

impl core::fmt::Display for FitError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Incomplete { missing, first } => {
                write!(
                    f,
                    "{missing} readings are missing, the first of them {first}"
                )
            }
            Self::TooLarge { limit } => write!(
                f,
                "more than three quarters of the readings are above {limit} sr^-1, which no material's are: readings are BRDFs, not counts"
            ),
        }
    }
}

impl core::error::Error for FitError {}

/// Errors of a finished fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum FinishError {
    /// It is not complete: it goes on by
    /// [`Scan::fit_under_way`](super::Scan::fit_under_way).
    Unfinished(Progress),
    /// A value, or the fitted material at a reading, is not a finite number: what was read is nothing
    /// that the recipe can learn.
    Diverged,
    /// The fit has a result, but it is unlikely to describe a material: look at the sensor. The result can still be
    /// taken, with [`Scan::fitted`](super::Scan::fitted).
    Implausible(Implausible),
}

impl FinishError {
    /// The code.
    #[must_use]
    pub const fn code(&self) -> ErrorCode {
        match self {
            Self::Unfinished(_) => ErrorCode::Unfinished,
            Self::Diverged => ErrorCode::Diverged,
            Self::Implausible(reason) => reason.code(),
        }
    }
}

impl core::fmt::Display for FinishError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Unfinished(Progress { done, total }) => {
                write!(f, "the fit is not complete: {done} of {total} units are done")
            }
            Self::Diverged => f.write_str(
                "the fit diverged: the recipe describes no such material; check the units (sr^-1, not counts) and the sensor's range",
            ),
            Self::Implausible(reason) => reason.fmt(f),
        }
    }
}

impl core::error::Error for FinishError {}
