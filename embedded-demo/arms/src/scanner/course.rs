//! The course of a scan: to the samples, home after a few of them, and back to those whose readings
//! are lost.

use embedded_hal::digital::{InputPin, OutputPin};
use embedded_storage::nor_flash::NorFlash;
use glimpse_core::driver::{Config, Driver, Host};
use glimpse_core::fit::Fitter;
use glimpse_core::link::Failure;
use glimpse_core::scan::ReadingError;

use super::{News, Platform, Scanner, ScannerError};
use crate::goniometer::LostSteps;
use crate::sensor::Sensor;
use crate::station::Done;

/// Readings after which the arms go home, to see whether they have lost steps.
const READINGS_BETWEEN_CHECKS: u16 = 4;
/// Losses of steps that one scan survives.
const LOSSES: u8 = 3;

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
    /// Attempts at the present sample whose result could not be a reading.
    refused: u8,
}

impl Course {
    /// A course that has begun, if somebody has given a command before.
    pub(super) fn new(started: bool) -> Self {
        Self {
            started,
            ..Self::default()
        }
    }
}

/// Counts an attempt whose result cannot be a reading. It was not kept, so the sample is read again
/// at once, until the scan is given up.
///
/// The driver cannot count attempts: it receives good readings only once the arms are home, and
/// would count those at several samples as one.
fn refuse<K: Fitter, const CAPACITY: usize>(
    index: u16,
    error: ReadingError,
    driver: &mut Driver<'_, '_, K, CAPACITY>,
    course: &mut Course,
) {
    course.refused = course.refused.saturating_add(1);
    if course.refused >= Config::new(Host::Listens).attempts {
        driver.fail(Failure::Reading { index, error });
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
    pub(super) fn next<K: Fitter, const CAPACITY: usize>(
        &mut self,
        driver: &Driver<'_, '_, K, CAPACITY>,
        course: &mut Course,
    ) -> Result<(), ScannerError> {
        let scan = driver.scan().map_err(ScannerError::Scan)?;
        if !self.is_under_way(driver) {
            let recipe = scan.recipe();
            let (checksum, samples) = (recipe.checksum(), recipe.samples() as u16);
            self.readings.begin(&mut self.flash, checksum, samples)?;
        }
        let mut unread = None;
        for (index, _) in scan.pending() {
            if self.readings.get(&mut self.flash, index)?.is_none() {
                unread = unread.or(Some(index));
            }
        }
        let due = course.readings >= READINGS_BETWEEN_CHECKS || unread.is_none();
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
            (None, Some(index)) => Err(ScannerError::OutOfReach { index }),
            (None, None) => Ok(()),
        }
    }

    /// Saves a reading, or confirms those since the last visit home.
    pub(super) fn take_up<K: Fitter, const CAPACITY: usize>(
        &mut self,
        done: Done,
        driver: &mut Driver<'_, '_, K, CAPACITY>,
        course: &mut Course,
        platform: &mut impl Platform,
    ) -> Result<(), ScannerError> {
        match done {
            Done::Read { index, reading } => match reading.check() {
                Ok(()) => {
                    self.readings.keep(&mut self.flash, index, reading)?;
                    course.readings = course.readings.saturating_add(1);
                    course.refused = 0;
                    platform.tell(News::Read { index, reading });
                    Ok(())
                }
                Err(error) => {
                    platform.tell(News::Refused { index, error });
                    refuse(index, error, driver, course);
                    Ok(())
                }
            },
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
        course.refused = 0;
        course.losses = course.losses.saturating_add(1);
        if course.losses > LOSSES {
            return Err(ScannerError::LostSteps(lost));
        }
        Ok(())
    }
}
