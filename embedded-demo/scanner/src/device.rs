//! The parts of a scanner together: each call shows what it does, keeps positions in the store, and stops on command.

use core::fmt::Write as _;
use core::future::Future;
use core::pin::pin;

use embassy_futures::select::{Either, Either3, select, select3};
use embassy_futures::yield_now;
use embassy_time::{Duration, Instant, Timer, with_deadline, with_timeout};
use embedded_hal::digital::{InputPin, OutputPin};
use embedded_io_async::{Read, Write};
use embedded_storage::nor_flash::NorFlash;
use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::geometry::Arms;
use glimpse_core::store::Store;
use heapless::String;

use crate::goniometer::StepCheck;
use crate::instrument::Instrument;
use crate::operator::{Command, Event, Operator};
use crate::optics::{Counts, Sensor};

/// The longest time to pass bytes to the line. A USB port that nobody reads takes none; they are sent again later.
const SEND_TIMEOUT: Duration = Duration::from_millis(100);
/// The same after a write that nobody has read.
const RETRY_TIMEOUT: Duration = Duration::from_millis(1);
/// The most bytes of a write. A host takes USB packets of 64 bytes only together with the next one.
const MAX_WRITE: usize = 63;
/// The pause after an error of the line.
const LINE_PAUSE: Duration = Duration::from_millis(100);
/// The time between two reports of an error from before the start.
const REPORT_INTERVAL: Duration = Duration::from_secs(2);
/// The time after which the last line of text is sent again.
const REMINDER: Duration = Duration::from_secs(10);
/// The longest line of text.
const TEXT_BYTES: usize = 256;

/// Shows an error from before the start, again and again: only another firmware helps.
pub async fn report(error: Error, operator: &mut impl Operator, line: &mut impl Write) -> ! {
    loop {
        let text = text(&mut Event::Failed(error), operator);
        _ = with_timeout(SEND_TIMEOUT, line.write_all(text.as_bytes())).await;
        _ = with_timeout(REPORT_INTERVAL, operator.command()).await;
    }
}

/// Shows an event to the operator, and returns it as a line of text.
fn text(event: &mut Event<'_>, operator: &mut impl Operator) -> String<TEXT_BYTES> {
    let mut text = String::new();
    // Text that is too long is cut.
    let _ = write!(text, "{event}").and_then(|()| text.write_str("\r\n"));
    operator.show(event);
    text
}

/// Machine, flash, operator and line.
pub(crate) struct Device<'s, S, H, R, F, O, I, T> {
    pub(crate) machine: &'s mut Instrument<S, H, R>,
    pub(crate) store: &'s mut Store<F>,
    operator: &'s mut O,
    receiver: I,
    sender: T,
    /// True if the line takes bytes.
    is_read: bool,
    /// The last line of text, and the time at which it is sent again, for a terminal that was opened later.
    text: String<TEXT_BYTES>,
    remind_at: Instant,
    /// A command that came while bytes were sent.
    command: Option<Command>,
    /// The arms' target, if they are there.
    at: Option<Arms>,
    /// Number of readings since the last homing.
    pub(crate) readings: u16,
}

impl<'s, S: OutputPin, H: InputPin, R: Sensor, F: NorFlash, O: Operator, I: Read, T: Write>
    Device<'s, S, H, R, F, O, I, T>
{
    /// Combines the parts. Positions and proofs from before a restart count.
    pub(crate) fn new(
        machine: &'s mut Instrument<S, H, R>,
        store: &'s mut Store<F>,
        operator: &'s mut O,
        (receiver, sender): (I, T),
    ) -> Self {
        if store.is_proven(machine.arms.settings_checksum()) {
            machine.arms.trust_directions();
        }
        if let Some(angles) = store.angles() {
            machine.arms.assume(angles);
        }
        Self {
            machine,
            store,
            operator,
            receiver,
            sender,
            is_read: true,
            text: String::new(),
            remind_at: Instant::MAX,
            command: None,
            at: None,
            readings: 0,
        }
    }

    /// Shows an event to the operator, and as a line of text on the line.
    pub(crate) async fn show(&mut self, mut event: Event<'_>) {
        self.text = text(&mut event, self.operator);
        self.send_text().await;
    }

    async fn send_text(&mut self) {
        self.remind_at = Instant::now() + REMINDER;
        let text = self.text.clone();
        self.send(text.as_bytes()).await;
    }

    /// Waits for a command.
    pub(crate) async fn command(&mut self) -> Command {
        loop {
            if let Some(command) = self.command.take() {
                return command;
            }
            let timer = Timer::at(self.remind_at);
            match select(self.operator.command(), timer).await {
                Either::First(command) => return command,
                Either::Second(()) => self.send_text().await,
            }
        }
    }

    /// Shows a question, and waits for the answer.
    ///
    /// # Errors
    /// [`ErrorCode::Stopped`].
    pub(crate) async fn ask(&mut self, question: Event<'_>) -> Result<(), Error> {
        self.show(question).await;
        match self.command().await {
            Command::Stop => Err(Error::new(ErrorCode::Stopped)),
            _ => Ok(()),
        }
    }

    /// Sends what the line takes. The driver repeats requests that are lost.
    pub(crate) async fn send(&mut self, mut bytes: &[u8]) {
        let mut due = self.send_deadline();
        while !bytes.is_empty() {
            let part = bytes.get(..MAX_WRITE).unwrap_or(bytes);
            let write = with_deadline(due, self.sender.write(part));
            let count = match select(self.operator.command(), write).await {
                Either::First(command) => {
                    if command == Command::Stop || self.command.is_none() {
                        self.command = Some(command);
                    }
                    continue;
                }
                Either::Second(Ok(Ok(count))) if count > 0 => count,
                Either::Second(result) => {
                    self.is_read = result.is_ok();
                    return;
                }
            };
            self.is_read = true;
            due = self.send_deadline();
            bytes = bytes.get(count..).unwrap_or_default();
        }
    }

    fn send_deadline(&self) -> Instant {
        Instant::now()
            + if self.is_read {
                SEND_TIMEOUT
            } else {
                RETRY_TIMEOUT
            }
    }

    /// Waits for a command, for bytes, which `receive` takes, or for a time in ms. The command comes first: a line may
    /// always have bytes or errors.
    pub(crate) async fn wait(
        &mut self,
        delay_ms: Option<u32>,
        receive: impl FnMut(&u8),
    ) -> Option<Command> {
        if Instant::now() >= self.remind_at {
            self.send_text().await;
        }
        if let Some(command) = self.command.take() {
            return Some(command);
        }
        let due = delay_ms.map(|ms| Instant::now() + Duration::from_millis(ms.into()));
        let timer = Timer::at(due.unwrap_or(Instant::MAX).min(self.remind_at));
        let mut buffer = [0; 64];
        let read = self.receiver.read(&mut buffer);
        match select3(self.operator.command(), read, timer).await {
            Either3::First(command) => return Some(command),
            Either3::Second(Ok(count @ 1..)) => {
                buffer.iter().take(count).for_each(receive);
                yield_now().await; // a line may always have bytes
            }
            Either3::Second(_) => {
                let pause = select(self.operator.command(), Timer::after(LINE_PAUSE));
                if let Either::First(command) = pause.await {
                    return Some(command);
                }
            }
            Either3::Third(()) => {}
        }
        None
    }

    /// Homes the arms, and confirms or deletes readings.
    ///
    /// # Errors
    /// Of the arms or the flash, or [`ErrorCode::Stopped`].
    pub(crate) async fn home(&mut self) -> Result<StepCheck, Error> {
        if self.machine.arms.needs_confirmation() {
            self.ask(Event::Question).await?;
        }
        self.show(Event::Homing).await;
        self.check_stop()?;
        self.save_angles(None)?;
        self.readings = 0;
        let homed = unless_stopped(self.machine.home(), self.operator).await;
        let check = self.rest(homed)?;
        let settings = self.machine.arms.settings_checksum();
        if self.machine.arms.directions_checked() && !self.store.is_proven(settings) {
            self.store.save_proven(settings)?;
        }
        self.store.confirm(check == StepCheck::Passed)?;
        Ok(check)
    }

    /// Moves the arms, unless they are there, and reads the counts.
    ///
    /// # Errors
    /// Of the arms, the sensor or the flash, or [`ErrorCode::Stopped`].
    pub(crate) async fn read(&mut self, arms: Arms, is_lit: bool) -> Result<Counts, Error> {
        self.check_stop()?;
        if self.at != Some(arms) {
            self.save_angles(None)?;
            let moved = unless_stopped(self.machine.move_to(arms), self.operator).await;
            self.rest(moved)?;
            self.at = Some(arms);
        }
        self.readings = self.readings.saturating_add(1);
        unless_stopped(self.machine.counts(is_lit), self.operator).await
    }

    /// Obeys a stop that came while bytes were sent.
    fn check_stop(&mut self) -> Result<(), Error> {
        match self.command.take_if(|command| *command == Command::Stop) {
            Some(_) => Err(Error::new(ErrorCode::Stopped)),
            None => Ok(()),
        }
    }

    /// Keeps the position of the arms, which are at rest or stopped.
    fn rest<V>(&mut self, moved: Result<V, Error>) -> Result<V, Error> {
        if moved.is_err() {
            self.stop();
        }
        self.save_angles(self.machine.arms.angles())?;
        moved
    }

    /// Stops the arms. Nothing moves until they are homed.
    pub(crate) fn stop(&mut self) {
        self.machine.arms.stop();
        self.at = None;
    }

    fn save_angles(&mut self, angles: Option<[f32; 4]>) -> Result<(), Error> {
        if angles.is_none() {
            self.at = None;
        }
        match self.store.angles() == angles {
            true => Ok(()),
            false => self.store.save_angles(angles),
        }
    }
}

/// Waits for a motion or a reading. Fails if the operator stops it; other commands have no effect in the meantime.
async fn unless_stopped<T>(
    motion: impl Future<Output = Result<T, Error>>,
    operator: &mut impl Operator,
) -> Result<T, Error> {
    let mut motion = pin!(motion);
    loop {
        match select(operator.command(), &mut motion).await {
            Either::First(Command::Stop) => return Err(Error::new(ErrorCode::Stopped)),
            Either::First(_) => {}
            Either::Second(result) => return result,
        }
    }
}
