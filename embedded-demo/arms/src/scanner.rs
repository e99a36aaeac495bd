//! A scan, from the home switches to the fitted material.
//!
//! [`Scanner::scan`] is the main loop of the firmware. The station moves the arms and reads the sensor, the flash
//! stores readings, and core's [`Driver`] fits and communicates with a host, if there is one. [`Platform`] connects the
//! rest of the firmware.
//!
//! Each reading is saved immediately. The scan uses it after the next homing, if the arms have not lost steps. After
//! lost steps, the samples since the last homing are read again. An invalid reading is not saved, and its sample is
//! read again immediately.

mod button;
mod clock;
mod event;
mod link;
mod outcome;
mod platform;
mod seeds;
mod state;
mod steps;

pub use button::{Button, Command};
pub use event::Event;
#[cfg(feature = "defmt")]
pub use event::log_values;
pub use outcome::{Outcome, ScannerError, StartMode};
pub use platform::Platform;
pub use seeds::Seeds;

use embedded_hal::digital::{InputPin, OutputPin};
use embedded_storage::nor_flash::NorFlash;
use glimpse_core::driver::{Action, Config, Driver, Host};
use glimpse_core::fit::Fitter;
use glimpse_core::link::Failure;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Scan;

use crate::sensor::Sensor;
use crate::station::{Station, StationError};
use crate::store::readings::Readings;
use crate::store::recipes::{Recipes, ReplaceError};
use clock::Clock;
use state::ScanState;

/// Timeout of a host's first reply, us. If it expires, a scan continues without a host.
const HOST_TIMEOUT_US: u32 = 2_000_000;

/// A scanner: the machine and its storage.
pub struct Scanner<S, D, H, A, L, F> {
    /// Arms, lamp and sensor.
    pub station: Station<S, D, H, A, L>,
    /// The flash.
    pub flash: F,
    /// The readings in the flash.
    pub readings: Readings,
    /// The recipes in the flash.
    pub recipes: Recipes,
    /// Seeds of the sequence numbers on the link.
    pub seeds: Seeds,
}

/// Returns the host and the start mode of the next scan. Only a scan that a command has already started continues
/// without another command.
fn next_scan(outcome: Outcome) -> (Host, StartMode) {
    match outcome {
        Outcome::NoHost | Outcome::HostLost { started: true } => {
            (Host::Absent, StartMode::Immediate)
        }
        Outcome::NotStarted
        | Outcome::Finished
        | Outcome::Failed(_)
        | Outcome::HostLost { started: false }
        | Outcome::RecipeStored { .. } => (Host::Listens, StartMode::OnCommand),
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
    /// Scans materials, one after the other, forever.
    ///
    /// The recipe is the active one in the flash, or `bundled` if the flash has none or `buffer` is too small for it. A
    /// host is optional: it receives progress and results, and may send another recipe.
    pub fn serve<K: Fitter>(
        &mut self,
        bundled: &[u8],
        buffer: &mut [u8],
        memory: &mut [f32],
        platform: &mut impl Platform,
    ) -> ! {
        let mut next = (Host::Listens, StartMode::OnCommand);
        let mut reported_saved = false;
        loop {
            let (host, start) = next;
            let recipe = match self.recipes.load(&mut self.flash, buffer) {
                Ok(recipe) => recipe.unwrap_or(bundled),
                Err(_) => bundled,
            };
            if start == StartMode::OnCommand && !reported_saved {
                self.report_saved(recipe, platform);
            }
            let outcome = self.scan::<K>(recipe, memory, host, start, platform);
            reported_saved = outcome == Outcome::NotStarted;
            if outcome != Outcome::NotStarted {
                platform.report(Event::Ended(outcome));
            }
            if let Outcome::RecipeStored { bytes, checksum } = outcome {
                let installed = self.install::<K>(bytes, checksum, buffer, memory.len());
                platform.report(Event::RecipeUpdate(installed));
            }
            next = next_scan(outcome);
        }
    }

    /// Reports the number of saved readings if a scan with this recipe was interrupted. The user then continues that
    /// scan or begins a new one.
    fn report_saved(&mut self, recipe: &[u8], platform: &mut impl Platform) {
        let Ok(recipe) = Recipe::parse(recipe) else {
            return; // the scan reports the error
        };
        let samples = recipe.samples() as u16;
        if self.readings.is_under_way(recipe.checksum(), samples) {
            let (readings, flash) = (&self.readings, &mut self.flash);
            let is_saved = |index: &u16| matches!(readings.get(flash, *index), Ok(Some(_)));
            let readings = (0..samples).filter(is_saved).count() as u16;
            platform.report(Event::Saved { readings });
        }
    }

    /// Installs the recipe that a host has sent. Declines it if no scan can use it, so it is not fetched again.
    fn install<K: Fitter>(
        &mut self,
        bytes: u32,
        checksum: u32,
        buffer: &mut [u8],
        memory_words: usize,
    ) -> Result<(), ReplaceError> {
        let accepts = |recipe: Recipe<'_>| match recipe.checksum() == checksum {
            true => Scan::<K>::accept(&recipe, memory_words)
                .map(|_| ())
                .map_err(ReplaceError::Scan),
            false => Err(ReplaceError::Mismatch),
        };
        let flash = &mut self.flash;
        let installed = self.recipes.install(flash, bytes, buffer, accepts);
        let installed = installed.map(|_| ());
        if installed.is_err() {
            self.recipes.decline(checksum);
        }
        installed
    }

    /// Scans one material with a recipe. With [`Host::Listens`] a host may send another recipe instead.
    pub fn scan<K: Fitter>(
        &mut self,
        recipe: &[u8],
        memory: &mut [f32],
        host: Host,
        start: StartMode,
        platform: &mut impl Platform,
    ) -> Outcome {
        let scan = Recipe::parse(recipe).map_err(Failure::Recipe);
        let scan = scan.and_then(|recipe| Scan::new(recipe, memory).map_err(Failure::Scan));
        let config = self.config(host);
        let mut driver: Driver<'_, K> = match scan {
            Ok(scan) => Driver::new(scan, config),
            Err(failure) => Driver::without_scan(failure, config),
        };
        // Every scan has a new driver, which does not know the declined recipe yet.
        if let Some(checksum) = self.recipes.declined() {
            driver.decline(checksum);
        }
        let mut clock = Clock::default();
        match self.run(&mut driver, host, start, &mut clock, platform) {
            Ok(outcome) => outcome,
            Err(error) => {
                self.station.stop();
                platform.save_positions(self.station.arms().positions());
                let error = self.delete_invalid_readings(error);
                match error {
                    ScannerError::Scan(_) => {} // the driver has reported it
                    _ => driver.fail(Failure::Machine),
                }
                if let Some(checksum) = driver.declined() {
                    self.recipes.decline(checksum);
                }
                if host == Host::Listens {
                    link::report_failure(&mut driver, &mut clock, platform);
                }
                Outcome::Failed(error)
            }
        }
    }

    /// Returns the options of the next driver.
    fn config(&mut self, host: Host) -> Config {
        let mut config = Config::new(host);
        // Before the first move, the driver skips samples out of reach, or fails if the recipe needs every reading.
        config.limits = Some(self.station.limits());
        config.recipe_bytes = self.recipes.capacity();
        // The flash counts boots, so seeds differ after a reset and after a power cut.
        config.sequence_seed = self.seeds.next();
        config
    }

    fn run<K: Fitter>(
        &mut self,
        driver: &mut Driver<'_, K>,
        host: Host,
        start: StartMode,
        clock: &mut Clock,
        platform: &mut impl Platform,
    ) -> Result<Outcome, ScannerError> {
        let mut state = ScanState::new(start == StartMode::Immediate);
        let (mut waited_us, mut has_replied) = (0_u32, host != Host::Listens);
        let mut finished = false;
        loop {
            let elapsed_us = platform.elapsed_us();
            waited_us = waited_us.saturating_add(elapsed_us);
            match platform.command() {
                Some(Command::NewScan) if !state.started => {
                    self.readings.end_scan(&mut self.flash)?;
                    state.started = true;
                }
                Some(Command::Continue) if !state.started => {
                    state.started = self.is_under_way(driver);
                    platform.report(match state.started {
                        true => Event::Resumed,
                        false => Event::NothingSaved,
                    });
                }
                _ => {}
            }
            link::exchange(driver, platform);
            if let Some(result) = self.station.poll(elapsed_us)? {
                self.handle_result(result, driver, &mut state, platform)?;
            }
            platform.save_positions(self.station.arms().positions());

            let action = driver.poll(clock.advance(elapsed_us));
            // Only a valid reply ends the driver's first wait. Received bytes alone may be noise.
            has_replied |= !matches!(action, Action::Wait);
            if state.started && !has_replied && waited_us >= HOST_TIMEOUT_US {
                return Ok(Outcome::NoHost);
            }
            match action {
                Action::Measure { .. } if state.started && self.station.is_idle() => {
                    self.begin_next_task(driver, &mut state)?;
                }
                // The next driver greets the host again, because the host may have another recipe by then.
                Action::Measure { .. } if !state.started && waited_us >= HOST_TIMEOUT_US => {
                    return Ok(Outcome::NotStarted);
                }
                Action::Store { offset, bytes } => {
                    let bytes = bytes.as_slice();
                    self.recipes.store(&mut self.flash, offset, bytes)?;
                }
                Action::Install { bytes, checksum } => {
                    return Ok(Outcome::RecipeStored { bytes, checksum });
                }
                Action::Finished(residual) => {
                    if let Some(fitted) = driver.scan().ok().and_then(Scan::fitted) {
                        platform.report_fit(residual, &mut fitted.values());
                    }
                    finished = true;
                }
                Action::Forget if finished => {
                    self.readings.end_scan(&mut self.flash)?;
                    return Ok(Outcome::Finished);
                }
                Action::Forget => self.readings.end_scan(&mut self.flash)?,
                // No stop is needed: the arms do not move while the driver waits for a reply.
                Action::Failed(Failure::NoReply) => {
                    let started = state.started;
                    return Ok(Outcome::HostLost { started });
                }
                Action::Failed(failure) => return Err(state.error(failure)),
                // The reading has already been saved.
                Action::Save { .. } => {}
                // The arms are moving, or the scan has not been started.
                Action::Measure { .. } => {}
                // The loop must not sleep while the arms move.
                Action::Wait | Action::Continue => {}
                _ => {} // actions of a newer driver
            }
        }
    }

    /// Deletes the readings that a failure makes invalid. All others stay, so the scan can be continued. Returns the
    /// error, or that of the flash.
    fn delete_invalid_readings(&mut self, error: ScannerError) -> ScannerError {
        let deleted = match error {
            // The same readings would fail again.
            ScannerError::Scan(Failure::Reading { .. } | Failure::Fit(_) | Failure::Diverged) => {
                self.readings.end_scan(&mut self.flash)
            }
            // The arm has stopped, so no homing can check the positions of its last readings.
            ScannerError::Station(StationError::Arm(_)) => {
                self.readings.discard_unconfirmed(&mut self.flash)
            }
            _ => Ok(()),
        };
        deleted.map_or_else(ScannerError::Store, |()| error)
    }

    fn is_under_way<K: Fitter>(&self, driver: &Driver<'_, K>) -> bool {
        driver.scan().is_ok_and(|scan| {
            let recipe = scan.recipe();
            let (checksum, samples) = (recipe.checksum(), recipe.samples() as u16);
            self.readings.is_under_way(checksum, samples)
        })
    }
}
