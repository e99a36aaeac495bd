//! The main loop.

use core::future::{Future, pending};
use core::pin::pin;

use crate::goniometer::StepCheck;
use embassy_futures::select::{Either, Either3, select, select3};
use embassy_futures::yield_now;
use embassy_time::{Duration, Instant, Timer, with_timeout};
use embedded_io_async::{Read, Write};
use glimpse_core::driver::{Action, Config, Driver};
use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::fit::ScanModel;
use glimpse_core::geometry::ArmAngles;
use glimpse_core::scan::Scan;

use crate::machine::Machine;
use crate::memory::Memory;
use crate::operator::{Command, Event, Operator};

/// The longest time to pass bytes to the line. A USB port that nobody reads takes none; they are sent again later.
const SEND_TIMEOUT: Duration = Duration::from_millis(100);
/// The most bytes of a write. A host takes USB packets of 64 bytes only together with the next one.
const MAX_WRITE: usize = 63;
/// The pause after an error of the line.
const LINE_PAUSE: Duration = Duration::from_millis(100);

const STOPPED: Error = Error::new(ErrorCode::Stopped);
const NO_DIRECTION: Error = Error::new(ErrorCode::OutOfReach);

/// Scans material after material. The arms are homed at once, so call it after a command of the operator.
///
/// Confirmed readings of `memory` continue their scan. `line` is a stream to a host and one from it; the future of a read
/// must not lose bytes when it is dropped, as those of buffered UARTs and USB ports. [`Config::recipe_bytes`] counts as 0.
pub async fn run<K: ScanModel>(
    mut scan: Scan<'_, K>,
    mut config: Config,
    mut line: (impl Read, impl Write),
    machine: &mut impl Machine,
    memory: &mut impl Memory,
    operator: &mut impl Operator,
) -> ! {
    config.recipe_bytes = 0;
    while let Err(error) = home(machine, memory, operator).await {
        operator.show(Event::Failed(error));
        while operator.command().await == Command::Stop {}
    }
    loop {
        for index in 0..scan.recipe().samples() as u16 {
            if let Some(reading) = memory.reading(index) {
                _ = scan.record(index, reading); // an invalid one is read again
            }
        }
        let mut scanner = Scanner {
            driver: Driver::new(scan, config),
            config,
            machine,
            memory,
            operator,
            arms: ArmAngles::default(),
            is_halted: false,
            forgets: false,
        };
        scanner.run(&mut line).await;
        config.sequence_seed = config.sequence_seed.wrapping_add(1 << 16);
        scan = match scanner.driver.into_scan() {
            Ok(scan) => scan,
            Err(_) => pending().await, // the driver has a scan
        };
        scan.restart();
    }
}

/// A driver, and what carries out its actions.
struct Scanner<'s, 'a, K: ScanModel, M, S, O> {
    driver: Driver<'a, K>,
    config: Config,
    machine: &'s mut M,
    memory: &'s mut S,
    operator: &'s mut O,
    arms: ArmAngles,
    /// True from a failure to a command.
    is_halted: bool,
    /// True if readings could not be deleted.
    forgets: bool,
}

impl<K: ScanModel, M: Machine, S: Memory, O: Operator> Scanner<'_, '_, K, M, S, O> {
    /// Scans until the arms were homed after a failure. Only confirmed readings count then.
    async fn run(&mut self, (receiver, sender): &mut (impl Read, impl Write)) {
        loop {
            let action = self.driver.poll(Instant::now().as_millis());
            self.send(sender).await;
            match action {
                Action::Wait => {
                    if let Some(command) = self.wait(receiver).await
                        && self.obey(command).await == Next::Restore
                    {
                        return;
                    }
                }
                Action::Measure { .. } => self.measure().await,
                Action::Save { index, reading } => {
                    if self.memory.save(index, reading).await.is_err() {
                        self.operator.show(Event::Unsaved);
                    }
                }
                Action::Forget => self.forget().await,
                Action::Finished(residual) => match self.home().await.and_then(StepCheck::passed) {
                    Ok(()) => {
                        if let Some(fitted) = self.driver.scan().ok().and_then(Scan::fitted) {
                            let values = &mut fitted.values();
                            self.operator.show(Event::Finished(residual, values));
                        }
                    }
                    Err(error) => self.driver.fail(error),
                },
                Action::Failed(error) => {
                    self.machine.stop();
                    self.is_halted = true;
                    self.operator.show(Event::Failed(error));
                }
                _ => yield_now().await,
            }
        }
    }

    /// Sends what the line takes. The driver repeats requests that are lost.
    async fn send(&mut self, sender: &mut impl Write) {
        while !self.driver.outgoing().is_empty() {
            let bytes = self.driver.outgoing();
            let part = bytes.get(..MAX_WRITE).unwrap_or(bytes);
            let count = match with_timeout(SEND_TIMEOUT, sender.write(part)).await {
                Ok(Ok(count)) if count > 0 => count,
                _ => bytes.len(),
            };
            self.driver.sent(count);
        }
    }

    /// Sleeps until bytes arrive, the driver has work, or a command.
    async fn wait(&mut self, receiver: &mut impl Read) -> Option<Command> {
        let delay = self.driver.poll_delay(Instant::now().as_millis());
        let timer = async {
            match delay {
                Some(ms) => Timer::after_millis(ms.into()).await,
                None => pending().await,
            }
        };
        let mut buffer = [0; 64];
        match select3(receiver.read(&mut buffer), timer, self.operator.command()).await {
            Either3::First(Ok(count @ 1..)) => {
                let bytes = buffer.iter().take(count);
                bytes.for_each(|byte| self.driver.receive(*byte));
                None
            }
            Either3::First(_) => {
                Timer::after(LINE_PAUSE).await;
                None
            }
            Either3::Second(()) => None,
            Either3::Third(command) => Some(command),
        }
    }

    /// Moves to the nearest pending sample, and reads it.
    async fn measure(&mut self) {
        let next = self.driver.scan().ok().and_then(|scan| {
            let Some(machine) = &self.config.machine else {
                let (index, directions) = scan.next_pending()?;
                return Some((index, ArmAngles::from_directions(&directions)));
            };
            let next = machine.nearest(scan.pending(), &self.arms)?;
            Some((next.index, next.arms))
        });
        let Some((index, arms)) = next else {
            return self.driver.fail(NO_DIRECTION);
        };
        let machine = &mut *self.machine;
        let read = async {
            machine.move_to(arms).await?;
            machine.read().await
        };
        match unless_stopped(read, self.operator).await {
            Ok(reading) => {
                self.arms = arms;
                _ = self.driver.record(index, reading); // an invalid reading is repeated
            }
            Err(error) => {
                self.machine.stop();
                self.driver.fail(error);
            }
        }
    }

    async fn home(&mut self) -> Result<StepCheck, Error> {
        self.arms = ArmAngles::default();
        home(self.machine, self.memory, self.operator).await
    }

    async fn forget(&mut self) {
        let forgotten = self.memory.forget().await;
        self.forgets = forgotten.is_err();
        if let Err(error) = forgotten {
            self.driver.fail(error); // a reset would restore them
        }
    }

    async fn obey(&mut self, command: Command) -> Next {
        if command == Command::Stop {
            // A complete scan has nothing to stop.
            if self.driver.scan().ok().and_then(Scan::fitted).is_none() {
                self.driver.fail(STOPPED);
            }
            return Next::Continue;
        }
        if self.forgets {
            self.forget().await;
            if self.forgets {
                return Next::Continue;
            }
        }
        if self.is_halted {
            if let Err(error) = self.home().await {
                self.driver.fail(error);
                return Next::Continue;
            }
            self.is_halted = false;
            if command == Command::Resume {
                return Next::Restore;
            }
        }
        if command == Command::Restart {
            self.driver.restart();
        }
        Next::Continue
    }
}

/// The next step after a command.
#[derive(PartialEq)]
enum Next {
    Continue,
    /// Begin again with the confirmed readings.
    Restore,
}

/// Homes the arms, and confirms or deletes readings.
async fn home(
    machine: &mut impl Machine,
    memory: &mut impl Memory,
    operator: &mut impl Operator,
) -> Result<StepCheck, Error> {
    match unless_stopped(machine.home(), operator).await {
        Ok(check) => {
            memory.record_homing(check).await?;
            Ok(check)
        }
        Err(error) => {
            machine.stop();
            Err(error)
        }
    }
}

/// Waits for a motion. Fails if the operator stops it; other commands have no effect while the arms move.
async fn unless_stopped<T>(
    motion: impl Future<Output = Result<T, Error>>,
    operator: &mut impl Operator,
) -> Result<T, Error> {
    let mut motion = pin!(motion);
    loop {
        match select(&mut motion, operator.command()).await {
            Either::First(result) => return result,
            Either::Second(Command::Stop) => return Err(STOPPED),
            Either::Second(_) => {}
        }
    }
}
