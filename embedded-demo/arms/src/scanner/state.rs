//! State of a scan: visits home, lost steps and failed attempts.

use glimpse_core::driver::Driver;
use glimpse_core::fit::Fitter;
use glimpse_core::link::Failure;
use glimpse_core::scan::{FitError, ReadingError};

use super::ScannerError;
use crate::sensor::SensorError;
use crate::station::StationError;

/// Number of readings between two visits home, which check for lost steps.
pub(super) const READINGS_BETWEEN_CHECKS: u16 = 4;
/// Number of step losses in one scan after which the next one ends it.
pub(super) const MAX_STEP_LOSSES: u8 = 3;
/// Attempts to read a sample.
const MAX_ATTEMPTS: u8 = 3;

/// The error of an attempt to read a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum AttemptError {
    /// The sensor could not be read.
    Sensor(SensorError),
    /// The reading is invalid.
    Reading(ReadingError),
}

/// The state of a scan.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ScanState {
    /// The scan was started by a command.
    pub(super) started: bool,
    /// The arms are homed in this scan.
    pub(super) homed: bool,
    /// Number of readings since the last visit home.
    pub(super) readings: u16,
    /// Number of step losses.
    pub(super) step_losses: u8,
    /// Failed attempts to read the present sample.
    pub(super) attempts: u8,
    /// A sample to skip, if the arms come home without lost steps.
    pub(super) unreadable: Option<u16>,
    /// The last error of the sensor.
    pub(super) sensor_error: Option<SensorError>,
}

impl ScanState {
    /// Creates the state of a scan that is or is not started yet.
    pub(super) fn new(started: bool) -> Self {
        Self {
            started,
            ..Self::default()
        }
    }

    /// Returns the error of a scan that ends by this failure. If no reading could be taken, the error is the sensor's.
    pub(super) fn error(&self, failure: Failure) -> ScannerError {
        match (failure, self.sensor_error) {
            (Failure::Fit(FitError::Incomplete { .. }), Some(error)) => {
                ScannerError::Station(StationError::Sensor(error))
            }
            _ => ScannerError::Scan(failure),
        }
    }
}

/// Counts a failed attempt to read a sample. Nothing was saved, so the sample is read again immediately. After
/// [`MAX_ATTEMPTS`] the sample is skipped, or the scan ends if the recipe needs every reading.
///
/// The driver cannot count attempts: it receives good readings only once the arms are home, and would count attempts
/// at several samples as those at one.
pub(super) fn handle_failed_attempt<K: Fitter>(
    index: u16,
    error: AttemptError,
    driver: &mut Driver<'_, K>,
    state: &mut ScanState,
) -> Result<(), ScannerError> {
    if let AttemptError::Sensor(error) = error {
        state.sensor_error = Some(error);
    }
    state.attempts = state.attempts.saturating_add(1);
    if state.attempts < MAX_ATTEMPTS {
        return Ok(());
    }
    state.attempts = 0;
    let scan = driver.scan();
    if scan.is_ok_and(|scan| scan.recipe().tolerates_missing()) {
        state.unreadable = Some(index);
        return Ok(());
    }
    match error {
        AttemptError::Sensor(error) => Err(ScannerError::Station(StationError::Sensor(error))),
        AttemptError::Reading(error) => {
            driver.fail(Failure::Reading { index, error });
            Ok(())
        }
    }
}
