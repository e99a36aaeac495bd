//! Steps of a scan: to the next sample, home after a few of them, and back to those whose readings are lost.

use embedded_hal::digital::{InputPin, OutputPin};
use embedded_storage::nor_flash::NorFlash;
use glimpse_core::driver::Driver;
use glimpse_core::fit::Fitter;
use glimpse_core::link::Failure;

use super::course::{Course, Fault, LOSSES, READINGS_BETWEEN_CHECKS, retry};
use super::{News, Platform, Scanner, ScannerError};
use crate::goniometer::LostSteps;
use crate::sensor::Sensor;
use crate::station::Done;

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
