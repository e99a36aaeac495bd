//! The course of a scan: to the samples, home after a few of them, and back to those whose readings
//! are lost.

use glimpse_core::driver::Driver;
use glimpse_core::fit::Fitter;
use glimpse_core::link::Failure;
use glimpse_core::scan::{FitError, ReadingError};

use super::ScannerError;
use crate::sensor::SensorError;
use crate::station::StationError;

/// Readings after which the arms go home, to see whether they have lost steps.
pub(super) const READINGS_BETWEEN_CHECKS: u16 = 4;
/// Losses of steps that one scan survives.
pub(super) const LOSSES: u8 = 3;
/// Attempts to read a sample.
const ATTEMPTS: u8 = 3;

/// The reason why an attempt has no reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Fault {
    /// The sensor could not be read.
    Sensor(SensorError),
    /// The result cannot be a reading.
    Reading(ReadingError),
}

/// The progress of a scan.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Course {
    /// Somebody has given a command.
    pub(super) started: bool,
    /// The arms were home once.
    pub(super) homed: bool,
    /// Readings since they were.
    pub(super) readings: u16,
    /// Losses of steps.
    pub(super) losses: u8,
    /// Failed attempts to read the present sample.
    pub(super) attempts: u8,
    /// A sample to skip, if the arms come home without a loss of steps.
    pub(super) unreadable: Option<u16>,
    /// The last error of the sensor.
    pub(super) sensor_error: Option<SensorError>,
}

impl Course {
    /// A course that has begun, if somebody has given a command before.
    pub(super) fn new(started: bool) -> Self {
        Self {
            started,
            ..Self::default()
        }
    }

    /// The error of a scan that ends by this failure. A scan in which the sensor could read nothing ends by the
    /// sensor's error.
    pub(super) fn error(&self, failure: Failure) -> ScannerError {
        match (failure, self.sensor_error) {
            (Failure::Fit(FitError::Incomplete { .. }), Some(error)) => {
                ScannerError::Station(StationError::Sensor(error))
            }
            _ => ScannerError::Scan(failure),
        }
    }
}

/// Counts a failed attempt to read a sample. Nothing was saved, so the sample is read again at once. After
/// [`ATTEMPTS`] the sample is skipped, or the scan ends if the recipe needs every reading.
///
/// The driver cannot count attempts: it receives good readings only once the arms are home, and would count attempts
/// at several samples as those at one.
pub(super) fn retry<K: Fitter>(
    index: u16,
    fault: Fault,
    driver: &mut Driver<'_, K>,
    course: &mut Course,
) -> Result<(), ScannerError> {
    if let Fault::Sensor(error) = fault {
        course.sensor_error = Some(error);
    }
    course.attempts = course.attempts.saturating_add(1);
    if course.attempts < ATTEMPTS {
        return Ok(());
    }
    course.attempts = 0;
    let scan = driver.scan();
    if scan.is_ok_and(|scan| scan.recipe().tolerates_missing()) {
        course.unreadable = Some(index);
        return Ok(());
    }
    match fault {
        Fault::Sensor(error) => Err(ScannerError::Station(StationError::Sensor(error))),
        Fault::Reading(error) => {
            driver.fail(Failure::Reading { index, error });
            Ok(())
        }
    }
}
