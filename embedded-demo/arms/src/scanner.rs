//! One scan, from the home switches to the fitted material.
//!
//! [`Scanner::scan`] is the loop of the firmware: the station moves and reads, the flash keeps, and
//! core's [`Driver`] fits and talks with a host, if there is one. Whatever else a firmware does has
//! its turn in each round, by [`Platform`].
//!
//! A reading is kept as soon as it was taken, but the scan takes it only once the arms have come
//! home without having lost a step since. If they had, what was read on the way is read again. What
//! cannot be a reading is not kept, and read again at once.

mod end;
mod line;
mod milliseconds;
mod news;
mod platform;

pub use end::{End, ScannerError, Start};
pub use news::News;
#[cfg(feature = "defmt")]
pub use news::log_values;
pub use platform::Platform;

use embedded_hal::digital::{InputPin, OutputPin};
use embedded_storage::nor_flash::NorFlash;
use glimpse_core::driver::{Action, Config, Driver, Host};
use glimpse_core::fit::Fitter;
use glimpse_core::link::Failure;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{Memory, ReadingError, Scan, ScanError};

use crate::goniometer::LostSteps;
use crate::sensor::Sensor;
use crate::station::{Done, Station, StationError};
use crate::store::readings::Readings;
use crate::store::recipes::{Recipes, ReplaceError};
use milliseconds::Milliseconds;

/// After so many readings the arms go home, to see whether they have lost steps.
const READINGS_BETWEEN_CHECKS: u16 = 4;
/// How often steps may be lost in one scan.
const LOSSES: u8 = 3;
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
}

/// What a scan knows of itself.
#[derive(Clone, Copy, Debug, Default)]
struct Course {
    /// Somebody has pressed the button, or it was under way before a reset.
    started: bool,
    /// The arms were home once.
    homed: bool,
    /// Readings since they were.
    readings: u16,
    /// How often steps were lost.
    losses: u8,
    /// How often what was read at the present sample could not be a reading.
    refused: u8,
}

/// Who is there and when it begins, after a scan has ended so. The arms move by themselves only for a
/// scan that was begun.
fn after(end: End) -> (Host, Start) {
    match end {
        End::Alone | End::Silent { started: true } => (Host::Absent, Start::Now),
        End::Stored { started: true, .. } => (Host::Listens, Start::IfUnderWay),
        End::Waiting
        | End::Finished
        | End::Failed(_)
        | End::Silent { started: false }
        | End::Stored { started: false, .. } => (Host::Listens, Start::ByButton),
    }
}

/// A new scan. Out of line: there are two calls of it.
#[inline(never)]
fn begin<'r, 'm, K: Fitter, const CAPACITY: usize>(
    recipe: Recipe<'r>,
    memory: &'m mut Memory<K, CAPACITY>,
) -> Result<Scan<'r, 'm, K, CAPACITY>, ScanError> {
    Scan::new(recipe, memory)
}

/// What was read at a sample cannot be a reading. It was not kept, so that it is read again here and
/// now, until the scan is given up.
///
/// Attempts are not the driver's to count: it hears of good readings only once the arms are home, and
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
    /// Scans one material after the other, for ever.
    ///
    /// The recipe is the one in force in the flash, or the `factory`'s if there is none; `buffer` has
    /// room for it. A host that listens hears of the scan and may send another recipe; without one
    /// the firmware does as well.
    pub fn serve<K: Fitter, const CAPACITY: usize>(
        &mut self,
        factory: &[u8],
        buffer: &mut [u8],
        memory: &mut Memory<K, CAPACITY>,
        platform: &mut impl Platform,
    ) -> ! {
        let mut next = (Host::Listens, Start::IfUnderWay);
        loop {
            let (host, start) = next;
            let recipe = match self.recipes.load(&mut self.flash, buffer) {
                Ok(recipe) => recipe.unwrap_or(factory),
                Err(_) => factory,
            };
            let end = self.scan(recipe, memory, host, start, platform);
            if end != End::Waiting {
                platform.tell(News::End(end));
            }
            if let End::Stored {
                bytes, checksum, ..
            } = end
            {
                let installed = self.install(bytes, checksum, buffer, memory);
                platform.tell(News::Recipe(installed));
            }
            next = after(end);
        }
    }

    /// Puts the recipe in force that a host has sent, if a scan can do with it. If not, it is not
    /// fetched again.
    fn install<K: Fitter, const CAPACITY: usize>(
        &mut self,
        bytes: u32,
        checksum: u32,
        buffer: &mut [u8],
        memory: &mut Memory<K, CAPACITY>,
    ) -> Result<(), ReplaceError> {
        let accepts = |recipe: Recipe<'_>| match recipe.checksum() == checksum {
            true => begin(recipe, memory)
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
    pub fn scan<K: Fitter, const CAPACITY: usize>(
        &mut self,
        recipe: &[u8],
        memory: &mut Memory<K, CAPACITY>,
        host: Host,
        start: Start,
        platform: &mut impl Platform,
    ) -> End {
        let scan = Recipe::parse(recipe).map_err(Failure::Recipe);
        let scan = scan.and_then(|recipe| begin(recipe, memory).map_err(Failure::Scan));
        let config = Config {
            recipe_bytes: self.recipes.room(),
            ..Config::new(host)
        };
        let mut driver = Driver::new(scan, config);
        // Each scan has a driver of its own.
        if let Some(checksum) = self.recipes.declined() {
            driver.decline(checksum);
        }
        match self.lead(&mut driver, host, start, platform) {
            Ok(end) => end,
            Err(error) => {
                self.station.stop();
                let error = self.keep_what_holds(error);
                match error {
                    ScannerError::Scan(_) => {} // the driver knows
                    _ => driver.fail(Failure::Machine),
                }
                if let Some(checksum) = driver.declined() {
                    self.recipes.decline(checksum);
                }
                if host == Host::Listens {
                    line::complain(&mut driver, platform);
                }
                End::Failed(error)
            }
        }
    }

    fn lead<K: Fitter, const CAPACITY: usize>(
        &mut self,
        driver: &mut Driver<'_, '_, K, CAPACITY>,
        host: Host,
        start: Start,
        platform: &mut impl Platform,
    ) -> Result<End, ScannerError> {
        let mut course = Course {
            started: match start {
                Start::ByButton => false,
                Start::IfUnderWay => self.is_under_way(driver),
                Start::Now => true,
            },
            ..Course::default()
        };
        let mut milliseconds = Milliseconds::default();
        let (mut waited, mut heard) = (0_u32, host != Host::Listens);
        let mut finished = false;
        if course.started && start == Start::IfUnderWay {
            platform.tell(News::GoesOn);
        }
        loop {
            let elapsed = platform.elapsed();
            waited = waited.saturating_add(elapsed);
            if platform.is_started() && !course.started {
                self.readings.end(&mut self.flash)?;
                course.started = true;
            }
            line::exchange(driver, platform);
            if let Some(done) = self.station.poll(elapsed)? {
                self.take_up(done, driver, &mut course, platform)?;
            }
            platform.remember(self.station.arms().positions());

            let action = driver.poll(milliseconds.of(elapsed));
            // A driver that greets only waits; anything else means that it has understood a reply.
            // Bytes alone may be noise.
            heard |= !matches!(action, Action::Wait { .. });
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
                    self.recipes.store(&mut self.flash, offset, &bytes)?;
                }
                Action::Install { bytes, checksum } => {
                    return Ok(End::Stored {
                        bytes,
                        checksum,
                        started: course.started,
                    });
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
                Action::Failed(failure) => return Err(ScannerError::Scan(failure)),
                // Readings were kept when they were taken, and this is no time to sleep.
                Action::Save { .. } | Action::Measure { .. } => {}
                Action::Wait { .. } | Action::Continue => {}
            }
        }
    }

    /// Forgets the readings that a failure makes useless, and keeps all others, so that a reset goes
    /// on with them.
    fn keep_what_holds(&mut self, error: ScannerError) -> ScannerError {
        let kept = match error {
            // They would fail in the same way again.
            ScannerError::Scan(Failure::Reading { .. } | Failure::Fit(_) | Failure::Diverged) => {
                self.readings.end(&mut self.flash)
            }
            // Nobody will know whether this arm was where its last readings say: it has stopped.
            ScannerError::Station(StationError::Arm(_)) => self.readings.discard(&mut self.flash),
            _ => Ok(()),
        };
        kept.map_or_else(ScannerError::Store, |()| error)
    }

    fn is_under_way<K: Fitter, const CAPACITY: usize>(
        &self,
        driver: &Driver<'_, '_, K, CAPACITY>,
    ) -> bool {
        driver.scan().is_ok_and(|scan| {
            let recipe = scan.recipe();
            let (checksum, samples) = (recipe.checksum(), recipe.samples() as u16);
            self.readings.is_under_way(checksum, samples)
        })
    }

    /// What comes next while the scan waits for readings: home, or to a sample.
    fn next<K: Fitter, const CAPACITY: usize>(
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

    /// Takes up what the station has done.
    fn take_up<K: Fitter, const CAPACITY: usize>(
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
