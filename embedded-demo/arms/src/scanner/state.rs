//! State of a scan: homing, lost steps and failed attempts.

use glimpse_core::driver::Driver;
use glimpse_core::fit::Fitter;
use glimpse_core::link::Failure;
use glimpse_core::scan::{FitError, ReadingError};

use super::ScannerError;
use crate::sensor::SensorError;
use crate::station::StationError;

/// Number of readings between two homings, which check for lost steps.
pub(super) const READINGS_BETWEEN_HOMINGS: u16 = 4;
/// Maximum number of step losses in one scan. The next one ends the scan.
pub(super) const MAX_STEP_LOSSES: u8 = 3;
/// Maximum number of attempts to read a sample.
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
    /// Number of readings since the last homing.
    pub(super) readings_since_homing: u16,
    /// Number of step losses.
    pub(super) step_losses: u8,
    /// Number of failed attempts to read the present sample.
    pub(super) failed_attempts: u8,
    /// A sample to skip if the next homing finds no lost steps.
    pub(super) unreadable: Option<u16>,
    /// The last error of the sensor.
    pub(super) sensor_error: Option<SensorError>,
}

impl ScanState {
    /// Creates the state of a new scan. `started` is true if it needs no command to start.
    pub(super) fn new(started: bool) -> Self {
        Self {
            started,
            ..Self::default()
        }
    }

    /// Returns the error of a scan that this failure has ended: the sensor's, if readings are missing because of it.
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
/// The driver cannot count the attempts. It receives valid readings only after the next homing, and would therefore add
/// up the failed attempts at several samples.
pub(super) fn handle_failed_attempt<K: Fitter>(
    index: u16,
    error: AttemptError,
    driver: &mut Driver<'_, K>,
    state: &mut ScanState,
) -> Result<(), ScannerError> {
    if let AttemptError::Sensor(error) = error {
        state.sensor_error = Some(error);
    }
    state.failed_attempts = state.failed_attempts.saturating_add(1);
    if state.failed_attempts < MAX_ATTEMPTS {
        return Ok(());
    }
    state.failed_attempts = 0;
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
