//! How a scan begins and ends.

use core::fmt;

use glimpse_core::link::Failure;

use crate::goniometer::LostSteps;
use crate::station::StationError;
use crate::store::StoreError;

/// When a scan begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Start {
    /// When the button is pressed.
    ByButton,
    /// At once if it was under way before a reset; else when the button is pressed.
    IfUnderWay,
    /// At once.
    Now,
}

/// How a scan ended.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum End {
    /// The material was fitted.
    Finished,
    /// Nobody has pressed the button yet.
    Waiting,
    /// Somebody wants to scan, and no host says a word.
    Alone,
    /// A host spoke, and then fell silent.
    Silent {
        /// The scan was begun, so that it goes on without a host. Otherwise nobody has asked the
        /// arms to move.
        started: bool,
    },
    /// A host has sent another recipe: it is stored, and waits for
    /// [`Recipes::install`](crate::store::recipes::Recipes::install).
    Stored {
        /// Its length.
        bytes: u32,
        /// The checksum by which it was offered.
        checksum: u32,
        /// The scan was begun before, by the old recipe.
        started: bool,
    },
    /// It was given up.
    Failed(ScannerError),
}

/// Why a scan was given up.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ScannerError {
    /// An arm or the sensor.
    Station(StationError),
    /// The flash.
    Store(StoreError),
    /// Steps were lost again and again: the last ones.
    LostSteps(LostSteps),
    /// The arms do not reach this sample.
    OutOfReach {
        /// Its index in the recipe's pattern.
        index: u16,
    },
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
            Self::OutOfReach { index } => write!(
                f,
                "the arms do not reach sample {index}: train a recipe with their limits"
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
