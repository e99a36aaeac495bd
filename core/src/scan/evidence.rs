//! Checks of a scan in addition to its fit: room light, drift, and readings from before a restart.

use serde::{Deserialize, Serialize};

use super::residual::Residual;
use crate::error::ErrorCode;

/// Checks of a scan by readings that the fit does not use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Evidence {
    /// The largest channel of the readings with the lamp off, relative to the mean reading of the samples. None if it was
    /// not read.
    pub dark: Option<f32>,
    /// The largest change of the first sample, read again at the end, relative to it, or to a tenth of the mean reading if
    /// that is larger. None if it was not read.
    pub drift: Option<f32>,
    /// Number of readings from before a restart of the device.
    pub restored: u16,
}

/// The limits of a scan's [`Evidence`]. A result beyond one of them is [implausible](Residual::implausible). 0, a negative
/// number or NaN: not limited, and the readings that it needs are not made.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct EvidenceLimits {
    /// The largest [`Evidence::dark`]. 0 if the lamp cannot be switched.
    pub dark: f32,
    /// The largest [`Evidence::drift`].
    pub drift: f32,
    /// The largest share of saturated readings.
    pub saturated: f32,
}

impl EvidenceLimits {
    /// 5 % of light with the lamp off, 5 % of drift, and a fifth of saturated readings.
    pub const DEFAULT: Self = Self {
        dark: 0.05,
        drift: 0.05,
        saturated: 0.2,
    };
    /// No limits, and no additional readings.
    pub const NONE: Self = Self {
        dark: 0.0,
        drift: 0.0,
        saturated: 0.0,
    };
}

impl Residual {
    /// Adds the evidence of a scan with this number of readings. A cause that it names precedes the effect on the fit.
    pub(crate) fn with_evidence(
        self,
        evidence: Evidence,
        limits: EvidenceLimits,
        recorded: u16,
    ) -> Self {
        let exceeds = |value: f32, limit: f32| limit > 0.0 && (value > limit || value.is_nan());
        let saturated = f32::from(self.saturated) / f32::from(recorded.max(1));
        let causes = [
            (ErrorCode::RoomLight, evidence.dark, limits.dark),
            (ErrorCode::Drift, evidence.drift, limits.drift),
            (ErrorCode::Saturated, Some(saturated), limits.saturated),
        ];
        let cause = causes
            .into_iter()
            .find(|(_, value, limit)| value.is_some_and(|value| exceeds(value, *limit)));
        let is_old = evidence.restored >= recorded;
        let restored = is_old.then_some(ErrorCode::Restored);
        Self {
            implausible: cause
                .map(|(code, ..)| code)
                .or(self.implausible)
                .or(restored),
            evidence,
            ..self
        }
    }
}
