//! Start and outcome of a scan.

use core::fmt;

use glimpse_core::link::Failure;

use crate::goniometer::LostSteps;
use crate::station::StationError;
use crate::store::StoreError;

/// The condition for the start of a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StartMode {
    /// On a [`Command`](super::Command).
    OnCommand,
    /// Immediately, because the command was given before.
    Immediate,
}

/// The outcome of a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Outcome {
    /// The material was fitted.
    Finished,
    /// No command was given yet.
    NotStarted,
    /// The scan was started, and no host replies.
    NoHost,
    /// A host replied, and then stopped replying.
    HostLost {
        /// The scan was started, so it continues without a host. Otherwise the arms must not move.
        started: bool,
    },
    /// A host has sent another recipe. It is stored, but not yet active: see
    /// [`Recipes::install`](crate::store::recipes::Recipes::install).
    RecipeStored {
        /// Its length in bytes.
        bytes: u32,
        /// The checksum in the host's offer.
        checksum: u32,
    },
    /// The scan failed.
    Failed(ScannerError),
}

/// The error of a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ScannerError {
    /// An error of an arm or the sensor.
    Station(StationError),
    /// An error of the flash.
    Store(StoreError),
    /// Steps were lost too often. The value is the last loss.
    LostSteps(LostSteps),
    /// An error of recipe, fit or link.
    Scan(Failure),
}

impl fmt::Display for ScannerError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Station(error) => error.fmt(f),
            Self::Store(error) => error.fmt(f),
            Self::LostSteps(LostSteps { arm, steps }) => write!(
                f,
                "arm {arm} repeatedly loses steps, {steps} the last time: reduce its speed, or remove obstacles"
            ),
            Self::Scan(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for ScannerError {}

impl From<StationError> for ScannerError {
    fn from(error: StationError) -> Self {
        Self::Station(error)
    }
}

impl From<StoreError> for ScannerError {
    fn from(error: StoreError) -> Self {
        Self::Store(error)
    }
}
