//! Errors of a scan.

use serde::{Deserialize, Serialize};

use super::implausible::Implausible;
use crate::error_code::ErrorCode;
use crate::fit::Progress;
use crate::model::ModelKind;

/// An error that prevents a scan.
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
    /// The recipe needs more memory than the firmware provides.
    Memory {
        /// Number of words (of 4 bytes) that it needs.
        needed: usize,
        /// Number of available words.
        found: usize,
    },
    /// The basis is not the one that the recipe names.
    Basis {
        /// The checksum of the recipe's basis. None if the recipe needs no basis.
        recipe: Option<u32>,
        /// The checksum of the whole basis from which this basis was made.
        found: u32,
    },
}

impl ScanError {
    /// The error's code.
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
                "the recipe is for the model {recipe}, the firmware's is {firmware}: change the firmware's model or the recipe"
            ),
            Self::Memory { needed, found } => write!(
                f,
                "the recipe needs {needed} words of memory, and {found} are available: compute the length with `recipe::memory_words`"
            ),
            Self::Basis {
                recipe: Some(recipe),
                found,
            } => write!(
                f,
                "the recipe names the basis {recipe:08x}, this one was made from {found:08x}: export the recipe's basis"
            ),
            Self::Basis { recipe: None, .. } => {
                f.write_str("the recipe needs no basis: remove `with_basis`")
            }
        }
    }
}

impl core::error::Error for ScanError {}

/// A reason why a sample cannot be skipped.
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
    /// The error's code.
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
                write!(
                    f,
                    "sample {index} does not exist: the pattern has {samples}"
                )
            }
        }
    }
}

impl core::error::Error for SkipError {}

/// An error that prevents a fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum FitError {
    /// Readings are missing, and the recipe needs them.
    Incomplete {
        /// Number of missing readings.
        missing: u16,
        /// Index of the first missing reading.
        first: u16,
    },
    /// More than three quarters of the values exceed a limit: they are counts, or are not divided by the white.
    TooLarge {
        /// The limit, sr^-1.
        limit: u16,
    },
}

impl FitError {
    /// The error's code.
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
                    "{missing} readings are missing, the first is {first}: record them"
                )
            }
            Self::TooLarge { limit } => write!(
                f,
                "more than three quarters of the values exceed {limit} sr^-1, unlike any material: convert counts to BRDFs"
            ),
        }
    }
}

impl core::error::Error for FitError {}

/// An error at the end of a fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum FinishError {
    /// The fit is not complete. Continue it with [`Scan::fit_under_way`](super::Scan::fit_under_way).
    Unfinished(Progress),
    /// A value, or the fitted material at a reading, is not a finite number: the recipe describes no material with such
    /// readings.
    Diverged,
    /// The fit has a result, but it is unlikely to describe a material: check the sensor.
    /// [`Scan::fitted`](super::Scan::fitted) still returns the result.
    Implausible(Implausible),
}

impl FinishError {
    /// The error's code.
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
