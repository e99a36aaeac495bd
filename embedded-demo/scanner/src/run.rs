//! The main loop.

use embassy_futures::yield_now;
use embassy_time::Instant;
use embedded_hal::digital::{InputPin, OutputPin};
use embedded_io_async::{Read, Write};
use embedded_storage::nor_flash::NorFlash;
use glimpse_core::driver::{Action, Config, Driver};
use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::fit::ScanModel;
use glimpse_core::geometry::{Arms, Directions};
use glimpse_core::link::Purpose;
use glimpse_core::scan::Scan;
use glimpse_core::store::Store;

use crate::device::Device;
use crate::instrument::Instrument;
use crate::operator::{Command, Event, Operator};
use crate::optics::{Optics, Sensor, White};

/// Number of readings after which the arms are homed, so that lost steps cost no more of them.
const READINGS_PER_HOMING: u16 = 32;

/// Scans material after material, and calibrates, on command.
///
/// Confirmed readings of `store` continue their scan. `line` is a stream from a host and one to it; the future of a read
/// must not lose bytes when it is dropped, as those of buffered UARTs and USB ports. [`Event`]s are lines of text on it,
/// between the frames of the link.
pub async fn run<K: ScanModel, S: OutputPin, H: InputPin, R: Sensor>(
    mut scan: Scan<'_, K>,
    mut config: Config,
    white: White,
    instrument: &mut Instrument<S, H, R>,
    store: &mut Store<impl NorFlash>,
    operator: &mut impl Operator,
    line: (impl Read, impl Write),
) -> ! {
    let mut device = Device::new(instrument, store, operator, line);
    let mut command = None;
    loop {
        let next = match command.take() {
            Some(command) => command,
            None => {
                scan.restart();
                let restored = device.store.restore(&mut scan).unwrap_or(0);
                let event = match scan.next_pending() {
                    None if restored > 0 => Event::Saved,
                    _ => Event::Waiting,
                };
                device.show(event).await;
                device.command().await
            }
        };
        let result = match next {
            Command::Stop => continue,
            Command::Calibrate => device
                .calibrate(white, config.limits.dark > 0.0)
                .await
                .map(|()| Event::Calibrated),
            Command::Resume | Command::Restart => {
                match device.begin(next, &mut scan, white).await {
                    Ok(optics) => {
                        let mut scanner = Scanner {
                            driver: Driver::new(scan, config),
                            config,
                            optics,
                        };
                        config.sequence_seed = config.sequence_seed.wrapping_add(1 << 16);
                        command = Some(device.scan(&mut scanner).await);
                        scan = scanner.driver.into_scan();
                        continue;
                    }
                    Err(error) => Err(error),
                }
            }
        };
        device.show(result.unwrap_or_else(Event::Failed)).await;
        command = Some(device.command().await);
    }
}

/// A driver, its options, and the conversion of counts in its scan.
struct Scanner<'a, K: ScanModel> {
    driver: Driver<'a, K>,
    config: Config,
    optics: Optics,
}

impl<S: OutputPin, H: InputPin, R: Sensor, F: NorFlash, O: Operator, I: Read, T: Write>
    Device<'_, S, H, R, F, O, I, T>
{
    /// Homes the arms, and records the readings that count. [`Command::Restart`] deletes them.
    async fn begin<K: ScanModel>(
        &mut self,
        command: Command,
        scan: &mut Scan<'_, K>,
        white: White,
    ) -> Result<Optics, Error> {
        if command == Command::Restart {
            self.store.clear()?;
        }
        let counts = self.store.white();
        let (dark, counts) = counts.ok_or(Error::new(ErrorCode::NotCalibrated))?;
        let optics = Optics::new(white, dark, counts)?;
        self.home().await?;
        scan.restart();
        self.store.restore(scan)?;
        Ok(optics)
    }

    /// Scans until a command follows the result or a failure.
    async fn scan<K: ScanModel>(&mut self, scanner: &mut Scanner<'_, K>) -> Command {
        let mut is_over = false;
        loop {
            let action = scanner.driver.poll(Instant::now().as_millis());
            let count = scanner.driver.outgoing().len();
            self.send(scanner.driver.outgoing()).await;
            scanner.driver.sent(count);
            match action {
                Action::Wait => {
                    let delay = scanner.driver.poll_delay(Instant::now().as_millis());
                    let driver = &mut scanner.driver;
                    match self.wait(delay, |byte| driver.receive(*byte)).await {
                        Some(Command::Stop) if !is_over => {
                            scanner.driver.fail(Error::new(ErrorCode::Stopped));
                        }
                        Some(command) if is_over && command != Command::Stop => return command,
                        _ => {}
                    }
                }
                Action::Measure {
                    purpose,
                    index,
                    directions,
                } => {
                    let measured = self.measure(scanner, purpose, index, directions).await;
                    measured.unwrap_or_else(|error| scanner.driver.fail(error));
                }
                Action::Save { index, reading } => {
                    if self.store.save(index, reading, false).is_err() {
                        self.show(Event::Unsaved).await;
                    }
                }
                // If this fails, a restart would restore them.
                Action::Forget => {
                    let cleared = self.store.clear();
                    cleared.unwrap_or_else(|error| scanner.driver.fail(error));
                }
                Action::Finished(residual) => {
                    match self.home().await.and_then(|check| check.passed()) {
                        Ok(()) => {
                            if let Some(fitted) = scanner.driver.scan().fitted() {
                                let values = &mut fitted.values();
                                self.show(Event::Finished(residual, values)).await;
                            }
                            is_over = true;
                        }
                        Err(error) => scanner.driver.fail(error),
                    }
                }
                Action::Failed(error) => {
                    self.stop();
                    self.show(Event::Failed(error)).await;
                    is_over = true;
                }
                _ => yield_now().await,
            }
        }
    }

    /// Moves to a sample, and reads it: for the fit, the one that takes least time.
    async fn measure<K: ScanModel>(
        &mut self,
        scanner: &mut Scanner<'_, K>,
        purpose: Purpose,
        index: u16,
        directions: Directions<f32>,
    ) -> Result<(), Error> {
        if self.readings >= READINGS_PER_HOMING {
            self.home().await?.passed()?;
        }
        let scan = scanner.driver.scan();
        // The order of a recipe for a time, and that of a target loss, count.
        let is_ordered = scan.recipe().is_in_path_order() || scanner.config.target_loss.is_some();
        let from = self.machine.arms.angles().map(Arms::from_array);
        let from = from.unwrap_or_default();
        let next = match &scanner.config.machine {
            None => Some((index, Arms::from_directions(&directions))),
            Some(machine) => {
                let sample = [(index, directions)].into_iter();
                let next = match purpose == Purpose::Sample && !is_ordered {
                    true => machine.nearest(scan.pending(), &from),
                    false => machine.nearest(sample, &from),
                };
                next.map(|next| (next.index, next.arms))
            }
        };
        let (index, arms) = next.ok_or(Error::new(ErrorCode::OutOfReach))?;
        let is_lit = purpose != Purpose::Dark;
        let counts = self.read(arms, is_lit).await?;
        let of = scan.recipe().samples() as u16;
        let number = of.saturating_sub(scan.pending().count() as u16);
        let event = match purpose {
            Purpose::Sample => Event::Reading(number.saturating_add(1), of, counts),
            Purpose::Dark | Purpose::Again => Event::Check(counts),
        };
        self.show(event).await;
        let reading = scanner.optics.reading(counts, &arms, is_lit)?;
        _ = scanner.driver.record(index, reading); // an invalid reading is repeated
        Ok(())
    }
}
