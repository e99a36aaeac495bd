//! Failures of a scan, and their form on the link.

use serde::{Deserialize, Serialize};

use super::Refusal;
use crate::error_code::{ErrorCode, RecipeError};

use crate::scan::{FitError, ReadingError, ScanError};

/// A failure that stops a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Failure {
    /// The recipe is damaged.
    Recipe(RecipeError),
    /// The recipe is for another firmware.
    Scan(ScanError),
    /// Too many readings of this sample were invalid.
    Reading {
        /// Index of the sample in the recipe's pattern.
        index: u16,
        /// The error of the last reading.
        error: ReadingError,
    },
    /// The host skipped this sample, but the recipe needs every reading.
    ReadingRequired {
        /// Index of the sample in the recipe's pattern.
        index: u16,
    },
    /// Samples are out of reach of the arms, and the recipe needs every reading.
    OutOfReach {
        /// Index of the first such sample in the recipe's pattern.
        index: u16,
        /// Number of samples out of reach.
        count: u16,
    },
    /// The readings cannot be fitted.
    Fit(FitError),
    /// The device's own arms or sensor failed.
    Machine,
    /// The device could not store a recipe.
    Storage,
    /// The host speaks another version of the protocol.
    Protocol {
        /// The device's version.
        device: u16,
        /// The host's version.
        host: u16,
    },
    /// The host refused a request.
    Refused(Refusal),
    /// The host did not reply to any retransmission.
    NoReply,
    /// The fit overflowed: the recipe describes no material with such readings.
    Diverged,
}

impl Failure {
    /// The failure's code.
    #[must_use]
    pub const fn code(&self) -> ErrorCode {
        match self {
            Self::Recipe(error) => error.code,
            Self::Scan(error) => error.code(),
            Self::Reading { error, .. } => error.code(),
            Self::ReadingRequired { .. } => ErrorCode::ReadingRequired,
            Self::OutOfReach { .. } => ErrorCode::OutOfReach,
            Self::Fit(error) => error.code(),
            Self::Machine => ErrorCode::Machine,
            Self::Storage => ErrorCode::Storage,
            Self::Protocol { .. } => ErrorCode::Protocol,
            Self::Refused(refusal) => refusal.code(),
            Self::NoReply => ErrorCode::NoReply,
            Self::Diverged => ErrorCode::Diverged,
        }
    }

    /// The details of a report. Unused details are 0. `core/docs/link.md` lists them.
    fn details(&self) -> [u32; 2] {
        let pair = |first: u16, second: u16| [first.into(), second.into()];
        match *self {
            Self::Recipe(error) => error.details,
            Self::Scan(ScanError::Model { firmware, recipe }) => [firmware as u32, recipe as u32],
            Self::Scan(ScanError::Memory { needed, found }) => [needed as u32, found as u32],
            Self::Scan(ScanError::Basis { recipe, found }) => [recipe.unwrap_or(0), found],
            Self::Reading { index, error } => match error {
                ReadingError::NonFinite(channel) | ReadingError::Negative(channel) => {
                    pair(index, channel.into())
                }
                ReadingError::Index { samples, .. } => pair(index, samples),
            },
            Self::ReadingRequired { index } => pair(index, 0),
            Self::OutOfReach { index, count } => pair(index, count),
            Self::Fit(FitError::Incomplete { missing, first }) => pair(missing, first),
            Self::Fit(FitError::TooLarge { limit }) => pair(limit, 0),
            Self::Protocol { device, host } => pair(device, host),
            Self::Refused(refusal) => pair(refusal.into(), 0),
            Self::Machine | Self::Storage | Self::NoReply | Self::Diverged => pair(0, 0),
        }
    }
}

impl core::fmt::Display for Failure {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Recipe(error) => error.fmt(f),
            Self::Scan(error) => error.fmt(f),
            Self::Reading { index, error } => write!(f, "reading {index}: {error}"),
            Self::ReadingRequired { index } => write!(
                f,
                "the host skipped sample {index}, but the recipe needs every reading: train one with `--missing`"
            ),
            Self::OutOfReach { index, count } => write!(
                f,
                "{count} samples are out of reach, the first is {index}: train within the machine's limits"
            ),
            Self::Fit(error) => error.fmt(f),
            Self::Protocol { device, host } => write!(
                f,
                "the device speaks version {device} of the protocol, the host version {host}: update one of them"
            ),
            Self::Refused(refusal) => refusal.fmt(f),
            Self::Machine | Self::Storage | Self::NoReply | Self::Diverged => {
                f.write_str(self.code().text())
            }
        }
    }
}

impl core::error::Error for Failure {}

/// A failure on the link: the number of its [`ErrorCode`], and two details whose meaning depends on the code
/// (`core/docs/link.md` lists them).
///
/// A host receives and prints codes that it does not know.
///
/// ```
/// use glimpse_core::link::{Failure, FailureReport};
///
/// let report = FailureReport::from(Failure::OutOfReach { index: 3, count: 2 });
/// assert_eq!((report.code, report.details), (105, [3, 2]));
/// let newer = FailureReport { code: 999, details: [7, 0] };
/// assert_eq!(newer.to_string(), "error 999, which this host does not know (details 7 and 0)");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FailureReport {
    /// The number of an error code.
    pub code: u16,
    /// Details. Unused ones are 0.
    pub details: [u32; 2],
}

impl FailureReport {
    /// The error; None if this version does not know the code.
    #[must_use]
    pub const fn error(&self) -> Option<ErrorCode> {
        ErrorCode::from_code(self.code)
    }
}

impl From<Failure> for FailureReport {
    fn from(failure: Failure) -> Self {
        Self {
            code: failure.code().code(),
            details: failure.details(),
        }
    }
}

impl core::fmt::Display for FailureReport {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let Self { code, details } = self;
        let [first, second] = details;
        match self.error() {
            Some(error) if *details == [0, 0] => write!(f, "{error} (error {code})"),
            Some(error) => write!(f, "{error} (error {code}, details {first} and {second})"),
            None => write!(
                f,
                "error {code}, which this host does not know (details {first} and {second})"
            ),
        }
    }
}

impl core::error::Error for FailureReport {}
