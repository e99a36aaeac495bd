//! Start and end of a scan.

use core::fmt;

use glimpse_core::link::Failure;

use crate::goniometer::LostSteps;
use crate::station::StationError;
use crate::store::StoreError;

/// The start of a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Start {
    /// On a [`Command`](super::Command).
    OnCommand,
    /// At once: somebody has given the command before.
    Now,
}

/// The end of a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum End {
    /// The material was fitted.
    Finished,
    /// Nobody has given a command yet.
    Waiting,
    /// A scan was begun, and no host replies.
    Alone,
    /// A host replied, and then fell silent.
    Silent {
        /// The scan was begun, so it goes on without a host. Otherwise nobody has asked the arms to
        /// move.
        started: bool,
    },
    /// A host has sent another recipe: it is stored, and waits for
    /// [`Recipes::install`](crate::store::recipes::Recipes::install).
    Stored {
        /// Its length.
        bytes: u32,
        /// The checksum by which it was offered.
        checksum: u32,
    },
    /// It was given up.
    Failed(ScannerError),
}

/// The reason why a scan was given up.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ScannerError {
    /// An arm or the sensor.
    Station(StationError),
    /// The flash.
    Store(StoreError),
    /// Steps were lost again and again: the last ones.
    LostSteps(LostSteps),
    /// Recipe, fit or link.
    Scan(Failure),
}

impl fmt::Display for ScannerError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Station(error) => error.fmt(f),
            Self::Store(error) => error.fmt(f),
            Self::LostSteps(LostSteps { arm, steps }) => write!(
                f,
                "arm {arm} loses steps again and again, {steps} the last time: let it go slower, or look what it hits"
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
