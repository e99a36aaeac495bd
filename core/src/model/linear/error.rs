//! Errors in reading a compact basis.

use super::format::VERSION;
use crate::error_code::ErrorCode;

/// An error in reading a compact basis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum BasisError {
    /// The first four bytes are not `GLMC`.
    Magic,
    /// A format version that this crate does not read.
    Version(u16),
    /// The length is not that of the header, or not that of the nodes and components.
    Length {
        /// Expected number of bytes.
        expected: u32,
        /// Actual number of bytes.
        found: u32,
    },
    /// The bytes were altered after they were written.
    Checksum,
    /// The number of components is 0, or larger than a recipe allows.
    Components(u16),
    /// An axis has fewer than two nodes, or the total number of nodes is too large for an address.
    Nodes,
    /// A scale is a NaN, an infinity or negative.
    Scale,
}

impl BasisError {
    /// The error's code.
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
                "the bytes are not a compact basis: they do not begin with GLMC; `trainer export \
                 --format basis` writes one",
            ),
            Self::Version(version) => write!(
                f,
                "compact basis format {version} is unknown: this version reads format {VERSION}; export \
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
                "the compact basis has {components} components, which is 0 or too many; export \
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
