//! Checks of a scan in addition to its fit: room light, drift, and readings from before a restart.

use serde::{Deserialize, Serialize};

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

/// The limits of a scan's [`Evidence`]. A result beyond one of them is [implausible](super::Residual::implausible). 0, a negative
/// number or NaN: not limited, and the readings that it needs are not made.
#[derive(Clone, Copy, Debug, PartialEq)]
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
