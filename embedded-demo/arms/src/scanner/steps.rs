//! Tasks of a scan: moves to samples, homing, and the handling of their results.

use core::iter;

use embedded_hal::digital::{InputPin, OutputPin};
use embedded_storage::nor_flash::NorFlash;
use glimpse_core::driver::Driver;
use glimpse_core::fit::Fitter;
use glimpse_core::link::Failure;

use super::state::{
    AttemptError, MAX_STEP_LOSSES, READINGS_BETWEEN_HOMINGS, ScanState, handle_failed_attempt,
};
use super::{Event, Platform, Scanner, ScannerError};
use crate::goniometer::LostSteps;
use crate::sensor::Sensor;
use crate::station::TaskResult;

impl<S, D, H, A, L, F> Scanner<S, D, H, A, L, F>
where
    S: OutputPin,
    D: OutputPin,
    H: InputPin,
    A: Sensor,
    L: OutputPin,
    F: NorFlash,
{
    /// Sends the arms home or to the next unread sample: the nearest one, or the next one of a recipe in path order.
    pub(super) fn begin_next_task<K: Fitter>(
        &mut self,
        driver: &Driver<'_, K>,
        state: &mut ScanState,
    ) -> Result<(), ScannerError> {
        let scan = driver.scan().map_err(ScannerError::Scan)?;
        if !self.is_under_way(driver) {
            let recipe = scan.recipe();
            let (checksum, samples) = (recipe.checksum(), recipe.samples() as u16);
            self.readings
                .begin_scan(&mut self.flash, checksum, samples)?;
        }
        let (mut unread, mut count) = (None, 0_u16);
        for (index, _) in scan.pending() {
            if self.readings.get(&mut self.flash, index)?.is_none() {
                unread = unread.or(Some(index));
                count = count.saturating_add(1);
            }
        }
        // After failed attempts the arms go home, because lost steps may be the reason.
        let has_unreadable = state.unreadable.is_some();
        let is_homing_due = state.readings_since_homing >= READINGS_BETWEEN_HOMINGS
            || unread.is_none()
            || has_unreadable;
        if !state.homed || is_homing_due {
            return Ok(self.station.go_home()?);
        }
        let (readings, flash) = (&self.readings, &mut self.flash);
        let mut pending = scan
            .pending()
            .filter(|(index, _)| matches!(readings.get(flash, *index), Ok(None)));
        let next = match scan.recipe().is_in_path_order() {
            true => pending.find_map(|sample| self.station.nearest(iter::once(sample))),
            false => self.station.nearest(pending),
        };
        let next = next.and_then(|next| {
            let mut pending = scan.pending();
            let (_, directions) = pending.find(|(index, _)| *index == next.index)?;
            Some((next, directions))
        });
        match (next, unread) {
            (Some((next, directions)), _) => Ok(self.station.read(next, directions)?),
            // The sample is within the limits, but needs a turn that an azimuth axis cannot make.
            (None, Some(index)) => Err(ScannerError::Scan(Failure::OutOfReach { index, count })),
            (None, None) => Ok(()),
        }
    }

    /// Handles the result of a task: saves a reading, or confirms the readings since the last homing.
    pub(super) fn handle_result<K: Fitter>(
        &mut self,
        result: TaskResult,
        driver: &mut Driver<'_, K>,
        state: &mut ScanState,
        platform: &mut impl Platform,
    ) -> Result<(), ScannerError> {
        match result {
            TaskResult::Read { index, reading } => match reading.check() {
                Ok(()) => {
                    self.readings.save(&mut self.flash, index, reading)?;
                    state.readings_since_homing = state.readings_since_homing.saturating_add(1);
                    state.failed_attempts = 0;
                    platform.report(Event::Read { index, reading });
                    Ok(())
                }
                Err(error) => {
                    platform.report(Event::InvalidReading { index, error });
                    handle_failed_attempt(index, AttemptError::Reading(error), driver, state)
                }
            },
            TaskResult::ReadFailed { index, error } => {
                platform.report(Event::ReadFailed { index, error });
                handle_failed_attempt(index, AttemptError::Sensor(error), driver, state)
            }
            TaskResult::Homed(Some(lost)) => self.handle_lost_steps(lost, state, platform),
            TaskResult::Homed(None) => {
                state.homed = true;
                state.readings_since_homing = 0;
                self.readings.confirm(&mut self.flash)?;
                let samples = driver.scan().map_or(0, |scan| scan.recipe().samples());
                let mut confirmed = 0_u16;
                for index in 0..samples as u16 {
                    let is_recorded = driver
                        .scan()
                        .is_ok_and(|scan| scan.reading(index).is_some());
                    if let Some(reading) = self.readings.get(&mut self.flash, index)?
                        && !is_recorded
                    {
                        driver.record(index, reading);
                        confirmed = confirmed.saturating_add(1);
                    }
                }
                platform.report(Event::Home { confirmed });
                if let Some(index) = state.unreadable.take()
                    && driver.skip(index).is_ok()
                {
                    platform.report(Event::Skipped { index });
                }
                Ok(())
            }
        }
    }

    /// Discards the readings since the last homing, because steps were lost.
    fn handle_lost_steps(
        &mut self,
        lost: LostSteps,
        state: &mut ScanState,
        platform: &mut impl Platform,
    ) -> Result<(), ScannerError> {
        platform.report(Event::LostSteps(lost));
        self.readings.discard_unconfirmed(&mut self.flash)?;
        state.homed = false;
        state.readings_since_homing = 0;
        state.failed_attempts = 0;
        state.unreadable = None;
        state.step_losses = state.step_losses.saturating_add(1);
        if state.step_losses > MAX_STEP_LOSSES {
            return Err(ScannerError::LostSteps(lost));
        }
        Ok(())
    }
}
