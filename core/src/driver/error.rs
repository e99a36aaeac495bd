//! Errors of calls of a driver.

#[cfg(doc)]
use super::Driver;
use crate::error_code::ErrorCode;
use crate::scan::{ReadingError, SkipError};

/// An error of [`Driver::record`], [`Driver::skip`] or [`Driver::finish_early`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum DriverError {
    /// The scan is finished, has failed, or does not exist: it takes no readings. Call [`Driver::restart`] or
    /// [`Driver::resume`] first.
    NotScanning,
    /// The reading is invalid, or the recipe has no such sample.
    Reading(ReadingError),
    /// The sample cannot be skipped.
    Skip(SkipError),
}

impl DriverError {
    /// The error's code.
    #[must_use]
    pub const fn code(&self) -> ErrorCode {
        match self {
            Self::NotScanning => ErrorCode::NotScanning,
            Self::Reading(error) => error.code(),
            Self::Skip(error) => error.code(),
        }
    }
}

impl From<SkipError> for DriverError {
    fn from(error: SkipError) -> Self {
        Self::Skip(error)
    }
}

impl core::fmt::Display for DriverError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NotScanning => self.code().fmt(f),
            Self::Reading(error) => error.fmt(f),
            Self::Skip(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for DriverError {}
