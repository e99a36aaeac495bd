//! Reasons why a fitted material is implausible.

use serde::{Deserialize, Serialize};

use crate::error_code::ErrorCode;

/// A reason why a fitted material is implausible.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[serde(from = "u16", into = "u16")]
#[non_exhaustive]
pub enum Implausible {
    /// The mean of the readings is not above 0, or all readings are too far below 0 for the loss: the dark reading or
    /// the sign is wrong.
    Dark,
    /// Every reading equals the one before it, bit for bit: the sensor is stuck.
    Repeated,
    /// A channel (0 red, 1 green, 2 blue) reads nothing while others do.
    DeadChannel(u8),
    /// The fitted material reflects several times the light that it receives: readings are counts, or were not
    /// divided by those of the white.
    Albedo,
    /// The residual of the fit is far larger than that of the recipe's other fits.
    Residual,
    /// A reason of a newer version, received over the link.
    Other,
}

impl Implausible {
    /// The reason's code.
    #[must_use]
    pub const fn code(&self) -> ErrorCode {
        match self {
            Self::Dark => ErrorCode::Dark,
            Self::Repeated => ErrorCode::Repeated,
            Self::DeadChannel(0) => ErrorCode::DeadRed,
            Self::DeadChannel(1) => ErrorCode::DeadGreen,
            Self::DeadChannel(_) => ErrorCode::DeadBlue,
            Self::Albedo => ErrorCode::Albedo,
            Self::Residual => ErrorCode::Residual,
            Self::Other => ErrorCode::ImplausibleOther,
        }
    }
}

impl From<Implausible> for u16 {
    fn from(reason: Implausible) -> Self {
        reason.code().code()
    }
}

impl From<u16> for Implausible {
    fn from(code: u16) -> Self {
        match ErrorCode::from_code(code) {
            Some(ErrorCode::Dark) => Self::Dark,
            Some(ErrorCode::Repeated) => Self::Repeated,
            Some(ErrorCode::DeadRed) => Self::DeadChannel(0),
            Some(ErrorCode::DeadGreen) => Self::DeadChannel(1),
            Some(ErrorCode::DeadBlue) => Self::DeadChannel(2),
            Some(ErrorCode::Albedo) => Self::Albedo,
            Some(ErrorCode::Residual) => Self::Residual,
            _ => Self::Other,
        }
    }
}

impl core::fmt::Display for Implausible {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        self.code().fmt(f)
    }
}
