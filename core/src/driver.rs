//! The main loop of a scanner's firmware, without I/O and without a clock.
//!
//! A [`Driver`] receives bytes from the line, readings, and the time. It returns the next [`Action`] and the bytes to
//! send. The firmware owns motors, sensor, UART, flash, clock and the loop. This one has three axes, a host that it does
//! not need, and readings that survive a reset:
//!
//! ```
//! use glimpse_core::driver::{Action, Config, Driver, Host};
//! use glimpse_core::error::{Error, ErrorCode};
//! use glimpse_core::geometry::Arms;
//! use glimpse_core::gonio::{Limits, Machine};
//! use glimpse_core::model::Neural;
//! use glimpse_core::recipe::{Recipe, memory_words};
//! use glimpse_core::gonio::Reading;
//! use glimpse_core::link::Purpose;
//! use glimpse_core::scan::Scan;
//! use glimpse_core::store::{Layout, Store};
//!
//! static RECIPE: &[u8] = include_bytes!("../examples/recipes/neural-n8.recipe");
//! const LAYOUT: Layout = Layout { start: 0, area_bytes: 512 }; // two of them, of whole sectors
//!
//! # include!(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/common/flash.rs"));
//! # struct Board { now_ms: u64, arms: Arms, flash: Flash }
//! # impl Board {
//! #     fn now_ms(&mut self) -> u64 { self.now_ms += 1; self.now_ms }
//! #     fn uart_read(&mut self) -> Option<u8> { None }
//! #     fn uart_write(&mut self, _: u8) -> bool { true }
//! #     fn sleep_ms(&mut self, _: Option<u32>) {}
//! #     fn move_and_read(&mut self, to: Arms, is_lit: bool) -> Option<Reading> {
//! #         self.arms = to;
//! #         Some(Reading::new([0.2, 0.1, 0.01 * to.theta_i].map(|brdf| if is_lit { brdf } else { 0.0 })))
//! #     }
//! #     fn operator_continues(&mut self) -> bool { false }
//! # }
//! fn firmware(board: &mut Board) -> Result<(), Error> {
//!     // The lamp has no azimuth axis: it is fixed at 0, the default of `Machine::fixed`.
//!     let speeds = Arms { theta_i: 0.2, phi_i: 0.0, theta_o: 0.2, phi_o: 0.2 }; // rad/s
//!     let limits = Limits { max_theta_i: 1.55, max_theta_o: 1.55, ..Limits::NONE };
//!     let machine = Machine { speeds, ..Machine::new(limits) };
//!     let mut config = Config::new(Host::Listens);
//!     config.machine = Some(machine);
//!
//!     let mut memory = [0.0; memory_words(&[RECIPE])]; // a static in real firmware
//!     let mut scan = Scan::<Neural>::new(Recipe::parse(RECIPE)?, &mut memory)?;
//!     let mut store = Store::mount(board.flash.clone(), LAYOUT, scan.recipe())?; // owns the flash
//!     config.sequence_seed = store.count_boot()?;
//!     store.restore(&mut scan)?;
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
//!             Action::Measure { purpose, index, directions } => {
//!                 // Samples are read in the order that takes least time; other readings where they are asked for.
//!                 let sample = [(index, directions)].into_iter();
//!                 let next = match purpose {
//!                     Purpose::Sample => machine.nearest(driver.scan().pending(), &board.arms),
//!                     _ => machine.nearest(sample, &board.arms),
//!                 };
//!                 let is_lit = purpose != Purpose::Dark; // the lamp's switch
//!                 match next.and_then(|next| Some((next.index, board.move_and_read(next.arms, is_lit)?))) {
//!                     // The driver requests a sample with an invalid reading again.
//!                     Some((index, reading)) => _ = driver.record(index, reading),
//!                     None => driver.fail(Error::new(ErrorCode::Machine)),
//!                 }
//!             }
//!             Action::Save { index, reading } => {
//!                 let _ = store.save(index, reading, true); // if this fails, a reset loses it
//!             }
//!             Action::Finished(residual) => {
//!                 let fitted = driver.scan().fitted();
//!                 println!("{residual:?} {:?}", fitted.and_then(|fitted| fitted.values().next()));
//!             }
//!             Action::Forget => store.clear()?,
//!             Action::Failed(error) => println!("{error}"), // nothing moves; poll on, to report it
//!             Action::Wait => {
//!                 let delay = driver.poll_delay(board.now_ms());
//!                 board.sleep_ms(delay);
//!             }
//!             _ => {}
//!         }
//!         while let Some(byte) = driver.outgoing().first()
//!             && board.uart_write(*byte)
//!         {
//!             driver.sent(1);
//!         }
//!     }
//! }
//! # fn main() { // so that items can be included
//! #     firmware(&mut Board { now_ms: 0, arms: Arms::NORMAL, flash: Flash::new(2) }).unwrap();
//! # }
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
//! - **Retries back off.** The pause before the next `Hello` doubles with each failure from 0.5 s to 30 s.
//! - **A scan proves itself.** Its samples lie between two readings with the lamp off ([`Purpose::Dark`]), and the first one
//!   is read again at the end ([`Purpose::Again`]). [`Residual::implausible`](crate::scan::Residual::implausible) names room
//!   light, drift, saturation or readings from before a restart, if they exceed [`Config::limits`].
//!
//! # States
//!
//! `table.rs` has all states and all transitions. A byte of a reply completes a frame in [`Driver::receive`]; the next
//! [`Driver::poll`] turns the reply into an event of the table, or does the next work of the state.

mod action;
mod config;
mod pause;
mod pending_request;
mod proof;
mod step;
internal! { mod table }

pub use action::Action;
pub use config::{Config, Host};

use crate::error::{Error, ErrorCode};
use crate::fit::ScanModel;
use crate::gonio::Reading;
use crate::link::{Purpose, Request};
use crate::scan::Scan;
use pause::Pause;
use pending_request::{PendingRequest, PollResult};
use proof::Proof;
use table::{Event, State, Task};

/// The saved readings in memory that survives a reset.
#[derive(Clone, Copy, PartialEq)]
enum Flash {
    /// There are none.
    Empty,
    Saved,
    /// The firmware has to delete them.
    Forget,
}

/// The main loop of a scanner: it controls a scan from `Hello` to the result.
///
/// `K` is the model, as for a [`Scan`]. The [module](self) has an example.
pub struct Driver<'a, K: ScanModel> {
    scan: Scan<'a, K>,
    config: Config,
    request: PendingRequest,
    state: State,
    task: Task,
    /// True if the host answers.
    is_connected: bool,
    proof: Proof,
    /// Purpose and index of the requested reading.
    asked: Option<(Purpose, u16)>,
    /// True if a fit of the recorded readings did not reach the target loss.
    is_target_missed: bool,
    flash: Flash,
    /// The action of the next poll, after those of the flash.
    queued: Option<Action>,
    /// The pause before `Hello`.
    pause: Pause,
    /// The pause before a failure is reported again to a host that did not answer.
    report_pause: Pause,
    /// True if the last poll had nothing to do, and no call since then has added work.
    is_idle: bool,
    /// The end of a pause in ms.
    wake_at: Option<u64>,
}

impl<'a, K: ScanModel> Driver<'a, K> {
    /// Creates a driver for a scan, which begins with the next poll. After a reset, the driver does not know that there was
    /// a failure: create it only once an operator, or your supervision of the arms, allows a move.
    ///
    /// First restore readings that survived a reset ([`Store::restore`](crate::store::Store::restore)). The driver asks a
    /// host that measures if they are still valid. With other hosts, restore them only if the material is the same; the
    /// result states their number ([`Evidence::restored`](crate::scan::Evidence::restored)).
    #[must_use]
    pub fn new(scan: Scan<'a, K>, config: Config) -> Self {
        let restored = scan.recorded();
        let flash = match scan.pending().count() == scan.recipe().samples() {
            true => Flash::Empty,
            false => Flash::Saved,
        };
        Self {
            scan,
            config,
            request: PendingRequest::new(config.sequence_seed),
            state: State::Hello,
            task: Task::Scan,
            is_connected: false,
            // A host that measures confirms that they are of this material.
            proof: Proof::new(match config.host {
                Host::Measures => 0,
                Host::Listens | Host::Absent => restored,
            }),
            asked: None,
            is_target_missed: false,
            flash,
            queued: None,
            pause: Pause::default(),
            report_pause: Pause::default(),
            is_idle: false,
            wake_at: None,
        }
    }

    /// The scan.
    #[must_use]
    pub fn scan(&self) -> &Scan<'a, K> {
        &self.scan
    }

    /// Returns the scan, for example to use its memory for another recipe.
    #[must_use]
    pub fn into_scan(self) -> Scan<'a, K> {
        self.scan
    }

    /// Receives a byte from the line.
    pub fn receive(&mut self, byte: u8) {
        if self.request.receive(byte) {
            self.is_idle = false;
        }
    }

    /// The bytes to send. Call [`Driver::sent`] afterwards.
    #[must_use]
    pub fn outgoing(&self) -> &[u8] {
        self.request.outgoing()
    }

    /// Marks the first `count` outgoing bytes as sent.
    pub fn sent(&mut self, count: usize) {
        self.request.sent(count);
    }

    /// Records a reading of the device's own sensor, of samples in any order. After an [`Action::Measure`] for another
    /// [`Purpose`], a reading of its index is the one for that purpose.
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
        let is_check = self.is_check(index);
        let scan = self.active_scan()?;
        let recorded = match is_check {
            true => scan.check(index, reading),
            false => scan.record(index, reading).map(drop),
        };
        let Err(error) = recorded else {
            self.asked = None;
            match is_check {
                true => self.proof.record(reading, self.scan.mean_reading()),
                false => {
                    self.scan.mark_unsaved(index, true);
                    self.proof.record_sample(index, reading);
                    self.is_target_missed = false;
                }
            }
            self.pause.reset();
            return Ok(());
        };
        let is_attempt = error.code != ErrorCode::ReadingIndex;
        if is_attempt && scan.count_invalid_reading(index, attempts) {
            let is_read = scan.reading(index).is_some();
            self.asked = None;
            match is_check {
                true => self.proof.advance(),
                false if !is_read && self.scan.skip(index).is_err() => self.fail(error),
                false => {}
            }
        }
        Err(error)
    }

    /// Skips a sample that cannot be read. A later [`Driver::record`] of the sample undoes the skip. After an
    /// [`Action::Measure`] for another [`Purpose`], the driver goes on without that reading.
    ///
    /// # Errors
    /// Fails like [`Scan::skip`], or with [`ErrorCode::NotScanning`].
    pub fn skip(&mut self, index: u16) -> Result<(), Error> {
        let is_check = self.is_check(index);
        let scan = self.active_scan()?;
        match is_check {
            true => self.proof.advance(),
            false => {
                scan.skip(index)?;
                scan.mark_unsaved(index, true);
            }
        }
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

    /// Returns true if a reading of this index is not that of a sample.
    fn is_check(&self, index: u16) -> bool {
        let is_check = |(purpose, asked)| purpose != Purpose::Sample && asked == index;
        self.asked.is_some_and(is_check)
    }

    /// Returns the scan if it takes readings.
    fn active_scan(&mut self) -> Result<&mut Scan<'a, K>, Error> {
        let is_halted = matches!(
            self.state,
            State::Report { goes_on: false, .. } | State::Halted
        );
        match self.task == Task::Scan && !is_halted {
            true => Ok(&mut self.scan),
            false => Err(Error::new(ErrorCode::NotScanning)),
        }
    }

    /// Cancels the request for the reading of a skipped sample, or of any sample if `skipped` is None.
    fn cancel_measure(&mut self, skipped: Option<u16>) {
        self.is_idle = false;
        self.asked = None;
        if let Some(Request::Measure { index, .. }) = self.request.request()
            && skipped.is_none_or(|skipped| skipped == *index)
        {
            self.request.cancel();
        }
    }

    /// Stops the scan because of a failure, and keeps its readings. The driver returns [`Action::Failed`] once, and reports
    /// the failure to the host, again and again until the host answers. It requests no further move until
    /// [`Driver::resume`] or [`Driver::restart`].
    pub fn fail(&mut self, error: Error) {
        self.is_idle = false;
        self.apply(Event::Failed(error));
    }

    /// Continues a scan that has failed, with the readings that it has. Home the arms first if they may have lost their
    /// position. Without a failure, the call has no effect.
    ///
    /// With a host, the next `Hello` comes at the earliest 0.5 s after the failure. This pause doubles with each failure,
    /// up to 30 s, and a success, such as a valid reading, ends it. A failure of the arms does not lengthen it.
    pub fn resume(&mut self) {
        self.command(Event::Resume);
    }

    /// Begins a scan of the next material. If readings were saved, the next poll returns [`Action::Forget`].
    pub fn restart(&mut self) {
        self.clear();
        self.command(Event::Restart);
    }

    /// Carries out a command. A report that the host has not received yet goes first.
    fn command(&mut self, event: Event) {
        let before = self.state;
        self.apply(event);
        if event == Event::Restart || self.state != before {
            self.is_idle = false;
            self.queued = None;
            if !matches!(self.state, State::Report { .. }) {
                self.request.cancel();
            }
        }
    }

    /// Does the next unit of work, and returns the next action of the firmware. `now_ms` is the time of a monotonic
    /// clock with any origin, in ms.
    pub fn poll(&mut self, now_ms: u64) -> Action {
        self.wake_at = None;
        self.pause.begin(now_ms);
        self.report_pause.begin(now_ms);
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
        let due = self.wake_at.or_else(|| self.request.next_deadline())?;
        let delay = due.saturating_sub(now_ms);
        Some(u32::try_from(delay).unwrap_or(u32::MAX))
    }

    fn next_action(&mut self, now: u64) -> Action {
        if let Some(action) = self.queued_action() {
            return action;
        }
        match self.request.poll(now) {
            PollResult::Idle => match self.step(now) {
                Action::Continue => {}
                action => return action,
            },
            PollResult::Waiting => return Action::Wait,
            PollResult::Reply(request, reply) => self.handle_reply(&request, reply),
            PollResult::TimedOut => self.apply(Event::Silent),
        }
        self.queued_action().unwrap_or(Action::Continue)
    }

    /// Returns an action that does not depend on the time: readings of the previous scan are deleted first, then new
    /// ones are saved, then a failure or a result is shown.
    fn queued_action(&mut self) -> Option<Action> {
        if self.flash == Flash::Forget {
            self.flash = Flash::Empty;
            return Some(Action::Forget);
        }
        if let Some((index, reading)) = self.scan.take_unsaved() {
            self.flash = Flash::Saved;
            return Some(Action::Save { index, reading });
        }
        self.queued.take()
    }
}

impl<K: ScanModel> core::fmt::Debug for Driver<'_, K> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Driver")
            .field("state", &self.state)
            .field("config", &self.config)
            .finish_non_exhaustive()
    }
}
