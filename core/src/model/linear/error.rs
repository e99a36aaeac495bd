//! Errors of a compact basis.

use super::format::VERSION;
use crate::error_code::ErrorCode;

/// Errors of a compact basis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum BasisError {
    /// The first four bytes are not `GLMC`.
    Magic,
    /// A format version that this crate does not read.
    Version(u16),
    /// The file is longer or shorter than it says, or than its nodes and components need.
    Length {
        /// Bytes that it should have.
        expected: u32,
        /// Bytes at hand.
        found: u32,
    },
    /// The bytes were altered after they were written.
    Checksum,
    /// No components, or more than a recipe can have.
    Components(u16),
    /// Fewer than two nodes along an axis, or more than an address can count.
    Nodes,
    /// A scale is a NaN, an infinity or negative.
    Scale,
}

impl BasisError {
    /// The code.
    #[must_use]
    pub const fn code(&self) -> ErrorCode {
        match self {
            Self::Magic => ErrorCode::BasisMagic,
            Self::Version(_) => ErrorCode::BasisVersion,
            Self::Length { .. } => ErrorCode::BasisLength,
            Self::Checksum => ErrorCode::BasisChecksum,
            Self::Components(_) | Self::Nodes | Self::Scale => ErrorCode::BasisMalformed,
        }
    }
}

impl core::fmt::Display for BasisError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Magic => f.write_str(
                "this is not a compact basis: it does not begin with GLMC; `trainer export \
                 --format basis` writes one",
            ),
            Self::Version(version) => write!(
                f,
                "compact basis format {version} is unknown: this reads format {VERSION}; export \
                 the basis again"
            ),
            Self::Length { expected, found } => write!(
                f,
                "the compact basis should have {expected} bytes but has {found}: it was cut or \
                 padded"
            ),
            Self::Checksum => {
                f.write_str("the compact basis's checksum is wrong: its bytes were altered")
            }
            Self::Components(components) => write!(
                f,
                "the compact basis has {components} components, which is none or too many; export \
                 the basis again"
            ),
            Self::Nodes => f.write_str(
                "the compact basis has fewer than two nodes along an axis, or too many in all; \
                 export the basis again",
            ),
            Self::Scale => f.write_str(
                "a scale of the compact basis is negative or not finite; export the basis again",
            ),
        }
    }
}

impl core::error::Error for BasisError {}
