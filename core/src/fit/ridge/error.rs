//! Errors of ridge problems.

use serde::{Deserialize, Serialize};

/// A list or buffer of a ridge problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Part {
    /// The matrix A, n x m.
    Basis,
    /// The precisions p, m.
    Precision,
    /// The mapped measurements t, n.
    Mapped,
    /// The coefficients c, or another vector of length m.
    Coefficients,
    /// The memory of the factors.
    Factors,
    /// The scratch memory of a solve.
    Scratch,
}

impl core::fmt::Display for Part {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Basis => "basis",
            Self::Precision => "precision",
            Self::Mapped => "mapped measurements",
            Self::Coefficients => "coefficients",
            Self::Factors => "factors",
            Self::Scratch => "scratch",
        })
    }
}

/// An error in setting up or solving a ridge problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum RidgeError {
    /// The length of a list does not match the other lists.
    Length {
        /// The list.
        part: Part,
        /// The length of the list.
        found: usize,
    },
    /// A buffer is too small.
    Buffer {
        /// The buffer.
        part: Part,
        /// Required length, in numbers.
        needed: usize,
        /// Actual length, in numbers.
        found: usize,
    },
    /// The precision with this index is not a positive, finite number.
    Precision(usize),
}

impl core::fmt::Display for RidgeError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Length { part, found } => {
                write!(f, "the length {found} of the ridge problem's {part} does not match the other lists")
            }
            Self::Buffer {
                part,
                needed,
                found,
            } => write!(
                f,
                "the buffer for the ridge problem's {part} has {found} numbers but needs {needed}"
            ),
            Self::Precision(index) => {
                write!(f, "the precision of component {index} is not positive and finite")
            }
        }
    }
}

impl core::error::Error for RidgeError {}
