//! The course of a scan: to the samples, home after a few of them, and back to those whose readings
//! are lost.

use embedded_hal::digital::{InputPin, OutputPin};
use embedded_storage::nor_flash::NorFlash;
use glimpse_core::driver::Driver;
use glimpse_core::fit::Fitter;
use glimpse_core::link::Failure;
use glimpse_core::scan::{FitError, ReadingError};

use super::{News, Platform, Scanner, ScannerError};
use crate::goniometer::LostSteps;
use crate::sensor::{Sensor, SensorError};
use crate::station::{Done, StationError};

/// Readings after which the arms go home, to see whether they have lost steps.
const READINGS_BETWEEN_CHECKS: u16 = 4;
/// Losses of steps that one scan survives.
const LOSSES: u8 = 3;
/// Attempts to read a sample.
const ATTEMPTS: u8 = 3;

/// The reason why an attempt has no reading.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
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
    homed: bool,
    /// Readings since they were.
    readings: u16,
    /// Losses of steps.
    losses: u8,
    /// Failed attempts to read the present sample.
    attempts: u8,
    /// A sample to skip, if the arms come home without a loss of steps.
    unreadable: Option<u16>,
    /// The last error of the sensor.
    sensor_error: Option<SensorError>,
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
fn retry<K: Fitter>(
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

impl<S, D, H, A, L, F> Scanner<S, D, H, A, L, F>
where
    S: OutputPin,
    D: OutputPin,
    H: InputPin,
    A: Sensor,
    L: OutputPin,
    F: NorFlash,
{
    /// Sends the arms home or to the next sample.
    pub(super) fn next<K: Fitter>(
        &mut self,
        driver: &Driver<'_, K>,
        course: &mut Course,
    ) -> Result<(), ScannerError> {
        let scan = driver.scan().map_err(ScannerError::Scan)?;
        if !self.is_under_way(driver) {
            let recipe = scan.recipe();
            let (checksum, samples) = (recipe.checksum(), recipe.samples() as u16);
            self.readings.begin(&mut self.flash, checksum, samples)?;
        }
        let (mut unread, mut count) = (None, 0_u16);
        for (index, _) in scan.pending() {
            if self.readings.get(&mut self.flash, index)?.is_none() {
                unread = unread.or(Some(index));
                count = count.saturating_add(1);
            }
        }
        // Lost steps may be why a sample could not be read.
        let is_unreadable = course.unreadable.is_some();
        let due = course.readings >= READINGS_BETWEEN_CHECKS || unread.is_none() || is_unreadable;
        if !course.homed || due {
            return Ok(self.station.go_home()?);
        }
        let (readings, flash) = (&self.readings, &mut self.flash);
        let nearest = self.station.nearest(
            scan.pending()
                .filter(|(index, _)| matches!(readings.get(flash, *index), Ok(None))),
        );
        let nearest = nearest.and_then(|nearest| {
            let mut pending = scan.pending();
            let (_, directions) = pending.find(|(index, _)| *index == nearest.index)?;
            Some((nearest, directions))
        });
        match (nearest, unread) {
            (Some((nearest, directions)), _) => Ok(self.station.read(nearest, directions)?),
            // Within the limits, but an axis that does not turn would have to.
            (None, Some(index)) => Err(ScannerError::Scan(Failure::OutOfReach { index, count })),
            (None, None) => Ok(()),
        }
    }

    /// Saves a reading, or confirms those since the last visit home.
    pub(super) fn take_up<K: Fitter>(
        &mut self,
        done: Done,
        driver: &mut Driver<'_, K>,
        course: &mut Course,
        platform: &mut impl Platform,
    ) -> Result<(), ScannerError> {
        match done {
            Done::Read { index, reading } => match reading.check() {
                Ok(()) => {
                    self.readings.keep(&mut self.flash, index, reading)?;
                    course.readings = course.readings.saturating_add(1);
                    course.attempts = 0;
                    platform.tell(News::Read { index, reading });
                    Ok(())
                }
                Err(error) => {
                    platform.tell(News::Refused { index, error });
                    retry(index, Fault::Reading(error), driver, course)
                }
            },
            Done::Unread { index, error } => {
                platform.tell(News::Unread { index, error });
                retry(index, Fault::Sensor(error), driver, course)
            }
            Done::Home(Some(lost)) => self.lose(lost, course, platform),
            Done::Home(None) => {
                course.homed = true;
                course.readings = 0;
                self.readings.confirm(&mut self.flash)?;
                let samples = driver.scan().map_or(0, |scan| scan.recipe().samples());
                let mut confirmed = 0_u16;
                for index in 0..samples as u16 {
                    let known = driver
                        .scan()
                        .is_ok_and(|scan| scan.reading(index).is_some());
                    if let Some(reading) = self.readings.get(&mut self.flash, index)?
                        && !known
                    {
                        driver.record(index, reading);
                        confirmed = confirmed.saturating_add(1);
                    }
                }
                platform.tell(News::Home { confirmed });
                if let Some(index) = course.unreadable.take()
                    && driver.skip(index).is_ok()
                {
                    platform.tell(News::Skipped { index });
                }
                Ok(())
            }
        }
    }

    /// Steps were lost: what was read since the arms were home is read again.
    fn lose(
        &mut self,
        lost: LostSteps,
        course: &mut Course,
        platform: &mut impl Platform,
    ) -> Result<(), ScannerError> {
        platform.tell(News::LostSteps(lost));
        self.readings.discard(&mut self.flash)?;
        course.homed = false;
        course.readings = 0;
        course.attempts = 0;
        course.unreadable = None;
        course.losses = course.losses.saturating_add(1);
        if course.losses > LOSSES {
            return Err(ScannerError::LostSteps(lost));
        }
        Ok(())
    }
}
