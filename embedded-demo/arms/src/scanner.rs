//! One scan, from the home switches to the fitted material.
//!
//! [`Scanner::scan`] is the loop of the firmware: the station moves and reads, the flash keeps, and
//! core's [`Driver`] fits and talks with a host, if there is one. Whatever else a firmware does has
//! its turn in each round, by [`Platform`].
//!
//! A reading is kept as soon as it was taken, but the scan takes it only once the arms have come
//! home without having lost a step since. If they had, what was read on the way is read again. What
//! cannot be a reading is not kept, and read again at once.

mod button;
mod clock;
mod course;
mod end;
mod line;
mod news;
mod platform;
mod seeds;
mod steps;

pub use button::{Button, Command};
pub use end::{End, ScannerError, Start};
pub use news::News;
#[cfg(feature = "defmt")]
pub use news::log_values;
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
use course::Course;

/// A host has so many microseconds to say a first word before a scan goes on without.
const GREETING: u32 = 2_000_000;

/// A scanner: what moves and reads, and what it keeps in flash.
pub struct Scanner<S, D, H, A, L, F> {
    /// Arms, lamp and sensor.
    pub station: Station<S, D, H, A, L>,
    /// The flash.
    pub flash: F,
    /// The readings in it.
    pub readings: Readings,
    /// The recipes in it.
    pub recipes: Recipes,
    /// Seeds of the link's sequence numbers.
    pub seeds: Seeds,
}

/// The next scan's host and start. The arms move without a command only for a scan that has begun
/// since power-up.
fn after(end: End) -> (Host, Start) {
    match end {
        End::Alone | End::Silent { started: true } => (Host::Absent, Start::Now),
        End::Waiting
        | End::Finished
        | End::Failed(_)
        | End::Silent { started: false }
        | End::Stored { .. } => (Host::Listens, Start::OnCommand),
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
    /// Scans one material after the other, for ever.
    ///
    /// The recipe is the one in force in the flash, or the `factory`'s if there is none; `buffer` has
    /// room for it. A host that listens hears of the scan and may send another recipe; without one
    /// the firmware does as well.
    pub fn serve<K: Fitter>(
        &mut self,
        factory: &[u8],
        buffer: &mut [u8],
        memory: &mut [f32],
        platform: &mut impl Platform,
    ) -> ! {
        let mut next = (Host::Listens, Start::OnCommand);
        let mut has_asked = false;
        loop {
            let (host, start) = next;
            let recipe = match self.recipes.load(&mut self.flash, buffer) {
                Ok(recipe) => recipe.unwrap_or(factory),
                Err(_) => factory,
            };
            if start == Start::OnCommand && !has_asked {
                self.ask(recipe, platform);
            }
            let end = self.scan::<K>(recipe, memory, host, start, platform);
            has_asked = end == End::Waiting;
            if end != End::Waiting {
                platform.tell(News::End(end));
            }
            if let End::Stored { bytes, checksum } = end {
                let installed = self.install::<K>(bytes, checksum, buffer, memory.len());
                platform.tell(News::Recipe(installed));
            }
            next = after(end);
        }
    }

    /// Reports the saved readings of a scan by this recipe that has not ended: somebody has to decide
    /// between them and a new material.
    fn ask(&mut self, recipe: &[u8], platform: &mut impl Platform) {
        let Ok(recipe) = Recipe::parse(recipe) else {
            return; // the scan reports it
        };
        let samples = recipe.samples() as u16;
        if self.readings.is_under_way(recipe.checksum(), samples) {
            let (readings, flash) = (&self.readings, &mut self.flash);
            let is_saved = |index: &u16| matches!(readings.get(flash, *index), Ok(Some(_)));
            let readings = (0..samples).filter(is_saved).count() as u16;
            platform.tell(News::Saved { readings });
        }
    }

    /// Puts the recipe in force that a host has sent, if a scan can do with it. If not, it is not
    /// fetched again.
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
            false => Err(ReplaceError::Other),
        };
        let flash = &mut self.flash;
        let installed = self.recipes.install(flash, bytes, buffer, accepts);
        let installed = installed.map(|_| ());
        if installed.is_err() {
            self.recipes.decline(checksum);
        }
        installed
    }

    /// Scans one material by a recipe. With [`Host::Listens`] a host may send another recipe
    /// instead.
    pub fn scan<K: Fitter>(
        &mut self,
        recipe: &[u8],
        memory: &mut [f32],
        host: Host,
        start: Start,
        platform: &mut impl Platform,
    ) -> End {
        let scan = Recipe::parse(recipe).map_err(Failure::Recipe);
        let scan = scan.and_then(|recipe| Scan::new(recipe, memory).map_err(Failure::Scan));
        let config = self.config(host);
        let mut driver: Driver<'_, K> = match scan {
            Ok(scan) => Driver::new(scan, config),
            Err(failure) => Driver::without_scan(failure, config),
        };
        // Each scan has a driver of its own.
        if let Some(checksum) = self.recipes.declined() {
            driver.decline(checksum);
        }
        let mut clock = Clock::default();
        match self.lead(&mut driver, host, start, &mut clock, platform) {
            Ok(end) => end,
            Err(error) => {
                self.station.stop();
                platform.remember(self.station.arms().positions());
                let error = self.keep_what_holds(error);
                match error {
                    ScannerError::Scan(_) => {} // the driver knows
                    _ => driver.fail(Failure::Machine),
                }
                if let Some(checksum) = driver.declined() {
                    self.recipes.decline(checksum);
                }
                if host == Host::Listens {
                    line::complain(&mut driver, &mut clock, platform);
                }
                End::Failed(error)
            }
        }
    }

    /// Options of the next driver.
    fn config(&mut self, host: Host) -> Config {
        let mut config = Config::new(host);
        // Samples out of reach fail the scan, or are skipped, before the first move.
        config.limits = Some(self.station.limits());
        config.recipe_bytes = self.recipes.room();
        // The count of boots is in the flash, so that seeds differ after a reset and after a power cut.
        config.sequence_seed = self.seeds.next();
        config
    }

    fn lead<K: Fitter>(
        &mut self,
        driver: &mut Driver<'_, K>,
        host: Host,
        start: Start,
        clock: &mut Clock,
        platform: &mut impl Platform,
    ) -> Result<End, ScannerError> {
        let mut course = Course::new(start == Start::Now);
        let (mut waited, mut heard) = (0_u32, host != Host::Listens);
        let mut finished = false;
        loop {
            let elapsed = platform.elapsed();
            waited = waited.saturating_add(elapsed);
            match platform.command() {
                Some(Command::NewScan) if !course.started => {
                    self.readings.end(&mut self.flash)?;
                    course.started = true;
                }
                Some(Command::Continue) if !course.started => {
                    course.started = self.is_under_way(driver);
                    platform.tell(match course.started {
                        true => News::GoesOn,
                        false => News::NothingSaved,
                    });
                }
                _ => {}
            }
            line::exchange(driver, platform);
            if let Some(done) = self.station.poll(elapsed)? {
                self.take_up(done, driver, &mut course, platform)?;
            }
            platform.remember(self.station.arms().positions());

            let action = driver.poll(clock.advance(elapsed));
            // A driver that greets only waits; anything else means that it has understood a reply.
            // Bytes alone may be noise.
            heard |= !matches!(action, Action::Wait);
            if course.started && !heard && waited >= GREETING {
                return Ok(End::Alone);
            }
            match action {
                Action::Measure { .. } if course.started && self.station.is_idle() => {
                    self.next(driver, &mut course)?;
                }
                // A host is greeted anew from time to time: it may have another recipe.
                Action::Measure { .. } if !course.started && waited >= GREETING => {
                    return Ok(End::Waiting);
                }
                Action::Store { offset, bytes } => {
                    let bytes = bytes.as_slice();
                    self.recipes.store(&mut self.flash, offset, bytes)?;
                }
                Action::Install { bytes, checksum } => {
                    return Ok(End::Stored { bytes, checksum });
                }
                Action::Finished(residual) => {
                    if let Some(fitted) = driver.scan().ok().and_then(Scan::fitted) {
                        platform.finished(residual, &mut fitted.values());
                    }
                    finished = true;
                }
                Action::Forget if finished => {
                    self.readings.end(&mut self.flash)?;
                    return Ok(End::Finished);
                }
                Action::Forget => self.readings.end(&mut self.flash)?,
                // The arms stand still while a host is asked something.
                Action::Failed(Failure::NoReply) => {
                    let started = course.started;
                    return Ok(End::Silent { started });
                }
                Action::Failed(failure) => return Err(course.error(failure)),
                // Readings were kept when they were taken, and this is no time to sleep.
                Action::Save { .. } | Action::Measure { .. } => {}
                Action::Wait | Action::Continue => {}
                _ => {} // actions of a newer driver
            }
        }
    }

    /// Forgets the readings that a failure makes useless, and keeps all others, so that the scan can
    /// be continued.
    fn keep_what_holds(&mut self, error: ScannerError) -> ScannerError {
        let kept = match error {
            // They would fail in the same way again.
            ScannerError::Scan(Failure::Reading { .. } | Failure::Fit(_) | Failure::Diverged) => {
                self.readings.end(&mut self.flash)
            }
            // The arm has stopped, and nobody can check where its last readings were taken.
            ScannerError::Station(StationError::Arm(_)) => self.readings.discard(&mut self.flash),
            _ => Ok(()),
        };
        kept.map_or_else(ScannerError::Store, |()| error)
    }

    fn is_under_way<K: Fitter>(&self, driver: &Driver<'_, K>) -> bool {
        driver.scan().is_ok_and(|scan| {
            let recipe = scan.recipe();
            let (checksum, samples) = (recipe.checksum(), recipe.samples() as u16);
            self.readings.is_under_way(checksum, samples)
        })
    }
}
