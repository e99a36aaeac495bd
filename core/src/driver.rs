//! The main loop of a scanner's firmware, without I/O and without a clock.
//!
//! A [`Driver`] receives bytes from the line, readings, and the time. It returns the next [`Action`] and the bytes to
//! send. The firmware owns motors, sensor, UART, flash, clock and the loop. This one has three axes, a host that it does
//! not need, and readings that survive a reset:
//!
//! ```
//! use glimpse_core::driver::{Action, Config, Driver, Host};
//! use glimpse_core::error::{Error, ErrorCode};
//! use glimpse_core::geometry::ArmAngles;
//! use glimpse_core::gonio::{Limits, Machine, Speeds};
//! use glimpse_core::model::Neural;
//! use glimpse_core::recipe::{Recipe, max_samples, memory_words};
//! use glimpse_core::gonio::Reading;
//! use glimpse_core::scan::{Saved, Scan};
//!
//! static RECIPE: &[u8] = include_bytes!("../examples/recipes/neural-n8.recipe");
//! const SLOT_BYTES: usize = Saved::slot_bytes(max_samples(&[RECIPE]));
//!
//! # struct Board { now_ms: u64, arms: ArmAngles, flash: [[u8; SLOT_BYTES]; 2] }
//! # impl Board {
//! #     fn boot_count(&self) -> u32 { 1 }
//! #     fn now_ms(&mut self) -> u64 { self.now_ms += 1; self.now_ms }
//! #     fn uart_read(&mut self) -> Option<u8> { None }
//! #     fn uart_write(&mut self, _: u8) -> bool { true }
//! #     fn sleep_ms(&mut self, _: Option<u32>) {}
//! #     fn move_and_read(&mut self, to: ArmAngles) -> Option<Reading> {
//! #         self.arms = to;
//! #         Some(Reading::new([0.2, 0.1, 0.01 * to.incoming.theta]))
//! #     }
//! #     fn operator_continues(&mut self) -> bool { false }
//! #     fn write_flash(&mut self, slot: usize, bytes: &[u8]) -> Result<(), Error> {
//! #         self.flash[slot][..bytes.len()].copy_from_slice(bytes);
//! #         Ok(())
//! #     }
//! # }
//! fn firmware(board: &mut Board) -> Result<(), Error> {
//!     // The lamp has no azimuth axis: it is fixed at 0, the default of `Machine::fixed`.
//!     let speeds = Speeds { theta_i: 0.2, phi_i: 0.0, theta_o: 0.2, phi_o: 0.2 }; // rad/s
//!     let limits = Limits { max_theta_i: 1.55, max_theta_o: 1.55, ..Limits::NONE };
//!     let machine = Machine { speeds, ..Machine::new(limits) };
//!     let mut config = Config::new(Host::Listens);
//!     config.machine = Some(machine);
//!     config.sequence_seed = board.boot_count(); // yours, in memory that survives a reset
//!
//!     let mut memory = [0.0; memory_words(&[RECIPE])]; // a static in real firmware
//!     let mut scan = Scan::<Neural>::new(Recipe::parse(RECIPE)?, &mut memory)?;
//!     let (mut saved, _) = Saved::restore([&board.flash[0], &board.flash[1]], &mut scan);
//!     let mut driver = Driver::new(scan, config);
//!     loop {
//! #       if board.now_ms > 2_500 { return Ok(()); }
//!         if board.operator_continues() {
//!             driver.resume(); // after a failure; `restart` begins a scan of the next material
//!         }
//!         while let Some(byte) = board.uart_read() {
//!             driver.receive(byte);
//!         }
//!         match driver.poll(board.now_ms()) {
//!             Action::Measure { .. } => {
//!                 let next = machine.nearest(driver.scan()?.pending(), &board.arms);
//!                 match next.and_then(|next| Some((next.index, board.move_and_read(next.arms)?))) {
//!                     // The driver requests a sample with an invalid reading again.
//!                     Some((index, reading)) => _ = driver.record(index, reading),
//!                     None => driver.fail(Error::new(ErrorCode::Machine)),
//!                 }
//!             }
//!             Action::Save { .. } => {
//!                 let write = |slot: usize, bytes: &[u8]| board.write_flash(slot, bytes);
//!                 let _ = saved.write(driver.scan()?, &mut [0; SLOT_BYTES], write); // a reset loses it
//!             }
//!             Action::Finished(residual) => {
//!                 let fitted = driver.scan()?.fitted();
//!                 println!("{} {:?}", residual.mean, fitted.and_then(|fitted| fitted.values().next()));
//!             }
//!             Action::Forget => _ = saved.clear(|slot, bytes| board.write_flash(slot, bytes)),
//!             Action::Failed(error) => println!("{error}"), // nothing moves; poll on, to report it
//!             Action::Wait => {
//!                 let delay = driver.poll_delay(board.now_ms());
//!                 board.sleep_ms(delay);
//!             }
//!             _ => {} // `Store` and `Install`, if the device can store recipes
//!         }
//!         while let Some(byte) = driver.outgoing().first()
//!             && board.uart_write(*byte)
//!         {
//!             driver.sent(1);
//!         }
//!     }
//! }
//! # let mut board = Board { now_ms: 0, arms: ArmAngles::default(), flash: [[0; SLOT_BYTES]; 2] };
//! # firmware(&mut board).unwrap();
//! ```
//!
//! # Guarantees
//!
//! - **Nothing moves after a failure** until [`Driver::resume`] or [`Driver::restart`]: no [`Action::Measure`], and no
//!   request that lets a host move its arms. A refusal by the host, or another version of its protocol, is a failure too.
//! - **A failure keeps all readings.** Nothing is forgotten that was not saved. [`Action::Forget`] comes when the host has
//!   accepted the result (without a host: after [`Action::Finished`]), after [`Driver::restart`], and when a host that
//!   measures does not know the readings.
//! - **A silent host that listens is optional.** If it does not answer [`Config::reply_timeout_ms`] long, the device scans
//!   alone. It then sends `Hello` after pauses of at most 30 s, and the result when somebody answers.
//! - **Retries back off.** The pause before the next `Hello` doubles with each failure from 0.5 s to 30 s, and the pause
//!   before a recipe is fetched again to one hour, because each attempt erases flash.

mod action;
mod config;
mod pause;
mod pending_request;
mod phase;
mod reach;
mod replies;
mod step;

pub use action::Action;
pub use config::{Config, Host};

use crate::error::{Error, ErrorCode};
use crate::fit::ScanModel;
use crate::gonio::Reading;
use crate::link::Request;
use crate::scan::Scan;
use pause::Pause;
use pending_request::{PendingRequest, PollResult};
use phase::Phase;

/// The longest pause before `Hello`, in ms.
const MAX_HELLO_PAUSE_MS: u32 = 30_000;
/// The longest pause before a recipe is fetched again, in ms.
const MAX_FETCH_PAUSE_MS: u32 = 3_600_000;

/// The main loop of a scanner: it controls a scan from `Hello` to the result.
///
/// `K` is the model, as for a [`Scan`]. The [module](self) has an example.
pub struct Driver<'a, K: ScanModel> {
    /// The scan, or the error that prevents it.
    scan: Result<Scan<'a, K>, Error>,
    config: Config,
    pending: PendingRequest,
    phase: Phase,
    /// True from a failure to [`Driver::resume`] or [`Driver::restart`].
    is_halted: bool,
    /// True if the host answers.
    is_connected: bool,
    /// True if [`Action::Finished`] was returned for the readings.
    is_finished: bool,
    /// Number of the fitted values that the host has accepted.
    values_sent: u16,
    /// True if a fit of the recorded readings did not reach the target loss.
    is_target_missed: bool,
    /// True if a reading may have to be saved.
    has_unsaved: bool,
    /// True if the firmware has saved readings.
    has_saved: bool,
    /// True if the firmware has to delete its saved readings.
    forgets: bool,
    /// The action of the next poll, after those of the fields above.
    next: Option<Action>,
    /// True if the host knows the failure that prevents a scan.
    is_no_scan_reported: bool,
    /// Checksum of a fetched recipe; the driver does not fetch it again.
    declined: Option<u32>,
    /// True if the host has accepted the result.
    is_published: bool,
    /// The pause before `Hello`.
    pause: Pause,
    /// The pause before a failure is reported again to a host that did not answer.
    report_pause: Pause,
    /// The pause before a recipe is fetched.
    fetch_pause: Pause,
    /// True if the last poll had nothing to do, and no call since then has added work.
    is_idle: bool,
    /// The end of a pause in ms.
    wake_at: Option<u64>,
}

impl<'a, K: ScanModel> Driver<'a, K> {
    /// Creates a driver for a scan, which begins with the next poll. After a reset, the driver does not know that there was
    /// a failure: create it only once an operator, or your supervision of the arms, allows a move.
    ///
    /// First restore readings that survived a reset ([`Saved::restore`](crate::scan::Saved::restore)). The driver asks a
    /// host that measures if they are still valid. With other hosts, restore them only if the material is the same.
    #[must_use]
    pub fn new(scan: Scan<'a, K>, config: Config) -> Self {
        Self::from_result(Ok(scan), config)
    }

    /// Creates a driver for a device whose recipe is damaged or for another firmware. It reports the failure to the
    /// host. If the device can store a recipe, it asks the host for another one, again and again.
    #[must_use]
    pub fn without_scan(error: Error, config: Config) -> Self {
        Self::from_result(Err(error), config)
    }

    fn from_result(scan: Result<Scan<'a, K>, Error>, config: Config) -> Self {
        let samples = scan.as_ref().map_or(0, |scan| scan.recipe().samples()) as u16;
        let is_read = |index| {
            scan.as_ref()
                .is_ok_and(|scan| scan.reading(index).is_some())
        };
        let has_saved = (0..samples).any(is_read);
        Self {
            scan,
            config,
            pending: PendingRequest::new(config.sequence_seed),
            phase: Phase::Hello,
            is_halted: false,
            is_connected: false,
            is_finished: false,
            values_sent: 0,
            is_target_missed: false,
            has_unsaved: false,
            has_saved,
            forgets: false,
            next: None,
            is_no_scan_reported: false,
            declined: None,
            is_published: false,
            pause: Pause::new(MAX_HELLO_PAUSE_MS),
            report_pause: Pause::new(MAX_HELLO_PAUSE_MS),
            fetch_pause: Pause::new(MAX_FETCH_PAUSE_MS),
            is_idle: false,
            wake_at: None,
        }
    }

    /// The scan.
    ///
    /// # Errors
    /// The error that was given to [`Driver::without_scan`].
    pub fn scan(&self) -> Result<&Scan<'a, K>, Error> {
        self.scan.as_ref().map_err(|error| *error)
    }

    /// Returns the scan, for example to use its memory for another recipe.
    ///
    /// # Errors
    /// The error that was given to [`Driver::without_scan`].
    pub fn into_scan(self) -> Result<Scan<'a, K>, Error> {
        self.scan
    }

    /// Receives a byte from the line.
    pub fn receive(&mut self, byte: u8) {
        if self.pending.receive(byte) {
            self.is_idle = false;
        }
    }

    /// The bytes to send. Call [`Driver::sent`] afterwards.
    #[must_use]
    pub fn outgoing(&self) -> &[u8] {
        self.pending.outgoing()
    }

    /// Marks the first `count` outgoing bytes as sent.
    pub fn sent(&mut self, count: usize) {
        self.pending.sent(count);
    }

    /// Records a reading of the device's own sensor. Samples may come in any order.
    ///
    /// After [`Config::attempts`] invalid readings of a sample, the driver skips it if the recipe tolerates missing
    /// readings. Otherwise the scan fails. A valid reading of the sample resets the count, and stays in use if later ones
    /// are invalid.
    ///
    /// # Errors
    /// The error of [`Scan::record`] if the reading is invalid, or the recipe has no such sample. The latter is not an
    /// attempt. [`ErrorCode::NotScanning`] if the scan takes no readings.
    pub fn record(&mut self, index: u16, reading: Reading) -> Result<(), Error> {
        self.is_idle = false;
        let attempts = self.config.attempts.max(1);
        let scan = self.active_scan()?;
        let Err(error) = scan.record(index, reading) else {
            scan.mark_unsaved(index);
            self.has_unsaved = true;
            self.is_target_missed = false;
            self.pause.reset();
            return Ok(());
        };
        let is_attempt = error.code != ErrorCode::ReadingIndex;
        if is_attempt && scan.count_invalid_reading(index) >= attempts {
            scan.forget_invalid_readings(index);
            let is_read = scan.reading(index).is_some();
            if !is_read && scan.skip(index).is_err() {
                self.fail(error);
            }
        }
        Err(error)
    }

    /// Skips a sample that cannot be read. A later [`Driver::record`] of the sample undoes the skip.
    ///
    /// # Errors
    /// Fails like [`Scan::skip`], or with [`ErrorCode::NotScanning`].
    pub fn skip(&mut self, index: u16) -> Result<(), Error> {
        self.active_scan()?.skip(index)?;
        self.cancel_measure(Some(index));
        Ok(())
    }

    /// Skips all pending samples, so that the fit uses only the recorded readings.
    ///
    /// # Errors
    /// Fails like [`Scan::finish_early`], or with [`ErrorCode::NotScanning`].
    pub fn finish_early(&mut self) -> Result<(), Error> {
        self.active_scan()?.finish_early()?;
        self.cancel_measure(None);
        Ok(())
    }

    /// Returns the scan if it takes readings.
    fn active_scan(&mut self) -> Result<&mut Scan<'a, K>, Error> {
        match &mut self.scan {
            Ok(scan) if !self.is_halted && !self.is_finished => Ok(scan),
            _ => Err(Error::new(ErrorCode::NotScanning)),
        }
    }

    /// Cancels the request for the reading of a skipped sample, or of any sample if `skipped` is None.
    fn cancel_measure(&mut self, skipped: Option<u16>) {
        self.is_idle = false;
        if let Some(Request::Measure { index, .. }) = self.pending.request()
            && skipped.is_none_or(|skipped| skipped == *index)
        {
            self.pending.cancel();
        }
    }

    /// Stops the scan because of a failure, and keeps its readings. The driver returns [`Action::Failed`] once, and reports
    /// the failure to the host, again and again until the host answers. It requests no further move until
    /// [`Driver::resume`] or [`Driver::restart`].
    ///
    /// If the recipe of [`Action::Store`] or [`Action::Install`] cannot be stored ([`ErrorCode::Storage`]), the driver
    /// fetches it again later, after a pause that doubles with each failure. If the recipe is unusable
    /// ([`ErrorCode::RecipeMagic`] to [`ErrorCode::Basis`]), it does not fetch it again.
    pub fn fail(&mut self, error: Error) {
        self.is_idle = false;
        self.pending.cancel();
        self.is_halted = true;
        self.report_pause.reset();
        if error.code != ErrorCode::Machine {
            self.pause.lengthen();
        }
        let is_fetched = matches!(self.phase, Phase::Installed) && !error.is_unusable_recipe();
        if is_fetched || matches!(self.phase, Phase::Store { .. } | Phase::Stored { .. }) {
            self.fetch_pause.lengthen();
            self.declined = None;
        }
        self.next = Some(Action::Failed(error));
        self.phase = match (self.config.host, error.code) {
            (Host::Absent, _) | (_, ErrorCode::NoReply) => self.phase_after_failure(),
            (Host::Measures | Host::Listens, _) => Phase::ReportFailure(error),
        };
    }

    /// The phase after a failure was reported. A device without a scan has nothing that moves: it asks for a recipe again.
    fn phase_after_failure(&self) -> Phase {
        let has_host = self.config.host != Host::Absent;
        if has_host && !self.is_halted && !self.is_published {
            return Phase::Hello; // the firmware has continued already
        }
        match self.scan.is_err() && has_host && self.config.recipe_bytes > 0 {
            true => Phase::Hello,
            false => Phase::Rest,
        }
    }

    /// Continues a scan that has failed, with the readings that it has. Home the arms first if they may have lost their
    /// position. Without a failure, the call has no effect.
    ///
    /// With a host, the next `Hello` comes at the earliest 0.5 s after the failure. This pause doubles with each failure,
    /// up to 30 s, and a success, such as a valid reading, ends it. A failure of the arms does not lengthen it.
    pub fn resume(&mut self) {
        if self.is_halted {
            self.begin_again();
            if self.is_published {
                self.phase = Phase::Rest;
            }
        }
    }

    /// Begins a scan of the next material. If readings were saved, the next poll returns [`Action::Forget`].
    pub fn restart(&mut self) {
        self.reset_scan();
        self.begin_again();
    }

    /// Begins with `Hello`, after a report that the host has not received yet.
    fn begin_again(&mut self) {
        self.is_idle = false;
        self.is_halted = false;
        self.next = None;
        let is_reporting = matches!(self.phase, Phase::ReportFailure(_));
        if !is_reporting || self.report_pause.has_failed() {
            self.pending.cancel();
            self.phase = Phase::Hello;
        }
    }

    /// Deletes all readings.
    fn reset_scan(&mut self) {
        if let Ok(scan) = &mut self.scan {
            scan.restart();
        }
        self.has_unsaved = false;
        self.is_finished = false;
        self.is_published = false;
        self.is_target_missed = false;
        self.forget();
    }

    /// Lets the firmware delete its saved readings, if it has any.
    fn forget(&mut self) {
        self.forgets |= core::mem::take(&mut self.has_saved);
    }

    /// Does the next unit of work, and returns the next action of the firmware. `now_ms` is the time of a monotonic
    /// clock with any origin, in ms.
    pub fn poll(&mut self, now_ms: u64) -> Action {
        self.wake_at = None;
        self.pause.begin(now_ms);
        self.report_pause.begin(now_ms);
        self.fetch_pause.begin(now_ms);
        let action = self.next_action(now_ms);
        self.is_idle = matches!(action, Action::Wait | Action::Measure { .. });
        action
    }

    /// The time until the next necessary [`Driver::poll`], in ms. None: poll again only after a received byte, a sent
    /// byte, or another call of this driver.
    #[must_use]
    pub fn poll_delay(&self, now_ms: u64) -> Option<u32> {
        if !self.is_idle {
            return Some(0);
        }
        let due = self.wake_at.or_else(|| self.pending.next_deadline())?;
        let delay = due.saturating_sub(now_ms);
        Some(u32::try_from(delay).unwrap_or(u32::MAX))
    }

    fn next_action(&mut self, now: u64) -> Action {
        if let Some(action) = self.queued_action() {
            return action;
        }
        match self.pending.poll(now) {
            PollResult::Idle => match self.step(now) {
                Action::Continue => {}
                action => return action,
            },
            PollResult::Waiting => return Action::Wait,
            PollResult::Reply(request, reply) => self.handle_reply(&request, reply, now),
            PollResult::TimedOut(request) => self.handle_timeout(&request),
        }
        self.queued_action().unwrap_or(Action::Continue)
    }

    /// Returns an action that does not depend on the time: readings of the previous scan are deleted first, then new
    /// ones are saved, then a failure is reported.
    fn queued_action(&mut self) -> Option<Action> {
        if core::mem::take(&mut self.forgets) {
            return Some(Action::Forget);
        }
        if self.has_unsaved
            && let Ok(scan) = &mut self.scan
        {
            if let Some((index, reading)) = scan.take_unsaved() {
                self.has_saved = true;
                return Some(Action::Save { index, reading });
            }
            self.has_unsaved = false;
        }
        self.next.take()
    }
}

impl<K: ScanModel> core::fmt::Debug for Driver<'_, K> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Driver")
            .field("phase", &self.phase)
            .field("config", &self.config)
            .finish_non_exhaustive()
    }
}

#[cfg(feature = "defmt")]
impl<K: ScanModel> defmt::Format for Driver<'_, K> {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "Driver({}, {})", self.phase, self.config);
    }
}
