//! An invalid ridge problem.

use serde::{Deserialize, Serialize};

/// A list of the wrong length.
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
    /// The coefficients c, or another vector of m.
    Coefficients,
    /// The memory of the factors.
    Factors,
    /// The memory that a solve works in.
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

/// An invalid ridge problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum RidgeError {
    /// A list does not have the length that the others ask for.
    Length {
        /// Which.
        part: Part,
        /// Its length.
        found: usize,
    },
    /// A buffer is too small.
    Buffer {
        /// Which.
        part: Part,
        /// Numbers that it has to hold.
        needed: usize,
        /// Numbers that it has room for.
        found: usize,
    },
    /// The precision with this index is not a positive, finite number.
    Precision(usize),
}

impl core::fmt::Display for RidgeError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Length { part, found } => {
                write!(f, "the ridge problem's {part} cannot have {found} entries")
            }
            Self::Buffer {
                part,
                needed,
                found,
            } => write!(
                f,
                "the ridge problem's {part} take {needed} numbers, there is room for {found}"
            ),
            Self::Precision(index) => {
                write!(f, "the precision of component {index} is not positive")
            }
        }
    }
}

impl core::error::Error for RidgeError {}
