//! Why a scan cannot begin, be fitted, or end.

use serde::{Deserialize, Serialize};

use crate::error_code::ErrorCode;
use crate::fit::{FitterError, Progress};
use crate::model::ModelKind;

/// Why a scan cannot begin.
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
    /// The recipe's pattern does not fit the capacity that this firmware was built with.
    Capacity {
        /// Samples that there is room for.
        capacity: usize,
        /// Samples of the recipe.
        samples: usize,
    },
    /// The recipe's fit takes more memory than this firmware gives it.
    Words {
        /// Numbers that it takes.
        needed: usize,
        /// Numbers that there is room for.
        found: usize,
    },
    /// The basis is not the one that the recipe names.
    Basis {
        /// The checksum that the recipe names; 0 if it names none.
        recipe: u32,
        /// The checksum that the basis was made from.
        found: u32,
    },
}

impl From<FitterError> for ScanError {
    fn from(error: FitterError) -> Self {
        match error {
            FitterError::Model { firmware, recipe } => Self::Model { firmware, recipe },
            FitterError::Words { needed, found } => Self::Words { needed, found },
        }
    }
}

impl ScanError {
    /// The code.
    #[must_use]
    pub const fn code(&self) -> ErrorCode {
        match self {
            Self::Model { .. } => ErrorCode::Model,
            Self::Capacity { .. } => ErrorCode::Samples,
            Self::Words { .. } => ErrorCode::Components,
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
            Self::Capacity { capacity, samples } => write!(
                f,
                "the recipe has {samples} samples, this firmware room for {capacity}: raise its CAPACITY"
            ),
            Self::Words { needed, found } => write!(
                f,
                "the recipe's fit takes {needed} words of memory, this firmware gives {found}: raise its WORDS"
            ),
            Self::Basis { recipe, found } => write!(
                f,
                "the recipe names the basis {recipe:08x}, this one was made from {found:08x}: export the recipe's own"
            ),
        }
    }
}

impl core::error::Error for ScanError {}

/// Why a sample cannot be skipped.
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

/// Why readings cannot be fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum FitError {
    /// Not all readings are taken, and the recipe cannot do without.
    Incomplete {
        /// How many are missing.
        missing: u16,
        /// The index of the first of them.
        first: u16,
    },
    /// More than three quarters of the readings are larger than this, in sr^-1: they are counts, or are not
    /// divided by the white.
    Implausible {
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
            Self::Implausible { .. } => ErrorCode::Implausible,
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
            Self::Implausible { limit } => write!(
                f,
                "more than three quarters of the readings are above {limit} sr^-1, which no material's are: readings are BRDFs, not counts"
            ),
        }
    }
}

impl core::error::Error for FitError {}

/// Why a fit has no result.
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
}

impl FinishError {
    /// The code.
    #[must_use]
    pub const fn code(&self) -> ErrorCode {
        match self {
            Self::Unfinished(_) => ErrorCode::Unfinished,
            Self::Diverged => ErrorCode::Diverged,
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
                "the fit diverged: no material that the recipe knows reads so; look at the units (sr^-1, not counts) and at the sensor's range",
            ),
        }
    }
}

impl core::error::Error for FinishError {}
