//! The main loop of a scanner's firmware, without I/O and without a clock.
//!
//! A [`Driver`] receives bytes from the line, readings, and the time. It returns the next [`Action`] and the bytes to
//! send. The firmware owns motors, sensor, UART, flash, clock and the loop:
//!
//! ```
//! use glimpse_core::driver::{Action, Config, Driver, Host};
//! use glimpse_core::model::Neural;
//! use glimpse_core::recipe::{Recipe, memory_words};
//! use glimpse_core::scan::{Reading, Scan};
//!
//! # fn now_ms() -> u64 { 0 }
//! # fn sleep(delay_ms: Option<u32>) {}
//! static RECIPE: &[u8] = include_bytes!("../examples/recipes/neural-n8.recipe");
//! let mut memory = [0.0; memory_words(&[RECIPE])];
//! let recipe = Recipe::parse(RECIPE).unwrap(); // firmware reports errors, see `Driver::without_scan`
//! let scan = Scan::<Neural>::new(recipe, &mut memory).unwrap();
//! let mut driver = Driver::new(scan, Config::new(Host::Absent));
//! loop {
//!     match driver.poll(now_ms()) {
//!         Action::Measure { index, .. } => driver.record(index, Reading::new([0.1; 3])),
//!         Action::Finished(residual) => {
//!             // Take the material now: the next poll returns `Forget`.
//!             let scan = driver.scan().unwrap();
//!             println!("{:?}", scan.fitted().unwrap().values().next());
//!             println!("{} {:?}", residual.mean, residual.implausible);
//!         }
//!         Action::Failed(failure) => panic!("{failure}"),
//!         Action::Save { .. } => {}  // `Saved::insert` and `write`, to flash
//!         // Erase the saved readings (`Saved::clear` and `write`). Then `restart` begins the next scan.
//!         Action::Forget => break,
//!         Action::Wait => sleep(driver.poll_delay(now_ms())),
//!         _ => {} // `Store` and `Install`, if the device can store recipes
//!     }
//! }
//! ```

mod action;
mod config;
mod pending_request;
mod phase;
mod reach;
mod replies;
mod step;

pub use action::Action;
pub use config::{Config, Host};

use crate::fit::Fitter;
use crate::link::{Failure, Request};
use crate::scan::{Reading, Scan, SkipError};
use pending_request::{PendingRequest, PollResult};
use phase::Phase;

/// The pause between a failure and the next attempt, in ms.
const PAUSE_MS: u64 = 500;

/// The main loop of a scanner: it controls a scan from `Hello` to the result, and then the next scan.
///
/// `K` is the model, as for a [`Scan`]. The [module](self) has an example.
pub struct Driver<'a, K: Fitter> {
    /// The scan, or the failure that prevents it.
    scan: Result<Scan<'a, K>, Failure>,
    config: Config,
    pending: PendingRequest,
    phase: Phase,
    /// Number of the fitted values that the host has accepted.
    values_sent: u16,
    /// Number of invalid readings in a row.
    invalid_readings: u8,
    /// True if a fit of the recorded readings did not reach the target loss.
    is_target_missed: bool,
    /// True if the firmware has to delete its saved readings.
    forgets: bool,
    /// Checksum of the last fetched recipe that was unusable; the driver does not fetch it again.
    declined: Option<u32>,
    /// The action that the next poll returns first.
    next: Option<Action>,
    /// True if the last poll had nothing to do, and no call since then has added work.
    is_idle: bool,
}

impl<'a, K: Fitter> Driver<'a, K> {
    /// Creates a driver for a scan. Record readings that survived a reset ([`Saved`](crate::scan::Saved)) with
    /// [`Scan::record`] before this call. The driver then asks a host that measures if they are still valid.
    ///
    /// The scan keeps the memory borrowed. Drop the driver to use the memory for another recipe.
    #[must_use]
    pub fn new(scan: Scan<'a, K>, config: Config) -> Self {
        Self::from_result(Ok(scan), config)
    }

    /// Creates a driver for a device whose recipe is damaged or for another firmware. It reports the failure to the
    /// host. If the device can store a recipe, it also asks the host for a better one.
    #[must_use]
    pub fn without_scan(failure: Failure, config: Config) -> Self {
        Self::from_result(Err(failure), config)
    }

    fn from_result(scan: Result<Scan<'a, K>, Failure>, config: Config) -> Self {
        Self {
            scan,
            config,
            pending: PendingRequest::new(config.sequence_seed),
            phase: Phase::Hello,
            values_sent: 0,
            invalid_readings: 0,
            is_target_missed: false,
            forgets: false,
            declined: None,
            next: None,
            is_idle: false,
        }
    }

    /// The scan.
    ///
    /// # Errors
    /// The failure that was given to [`Driver::without_scan`].
    pub fn scan(&self) -> Result<&Scan<'a, K>, Failure> {
        self.scan.as_ref().map_err(|failure| *failure)
    }

    /// Excludes the recipe with this checksum from updates. Call this if the recipe was unusable for an earlier driver.
    pub fn decline(&mut self, checksum: u32) {
        self.declined = Some(checksum);
    }

    /// The checksum of the last fetched recipe that was unusable.
    #[must_use]
    pub fn declined(&self) -> Option<u32> {
        self.declined
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

    /// Records a reading of the device's own sensor. Samples may come in any order, but at most one between two polls:
    /// the next poll returns [`Action::Save`] for the last reading only. A failed scan ignores readings.
    ///
    /// After [`Config::attempts`] invalid readings, the driver skips the sample if the recipe tolerates missing
    /// readings. Otherwise the scan fails.
    pub fn record(&mut self, index: u16, reading: Reading) {
        self.is_idle = false;
        if self.ignores_readings() {
            return;
        }
        let Ok(scan) = &mut self.scan else {
            return;
        };
        match scan.record(index, reading) {
            Ok(_) => {
                self.invalid_readings = 0;
                self.is_target_missed = false;
                self.next = Some(Action::Save { index, reading });
            }
            Err(error) => {
                self.invalid_readings = self.invalid_readings.saturating_add(1);
                if self.invalid_readings < self.config.attempts {
                    return;
                }
                self.invalid_readings = 0;
                // A valid earlier reading stays in use.
                let is_read = scan.reading(index).is_some();
                let tolerates = scan.recipe().tolerates_missing();
                if !(tolerates && (is_read || scan.skip(index).is_ok())) {
                    self.fail(Failure::Reading { index, error });
                }
            }
        }
    }

    /// Skips a sample that cannot be read. A later [`Driver::record`] of the sample undoes the skip. A failed scan
    /// ignores this call.
    ///
    /// # Errors
    /// Fails like [`Scan::skip`], and with [`SkipError::Index`] without a scan.
    pub fn skip(&mut self, index: u16) -> Result<(), SkipError> {
        let samples = 0;
        if self.ignores_readings() {
            return Ok(());
        }
        let Ok(scan) = &mut self.scan else {
            return Err(SkipError::Index { index, samples });
        };
        scan.skip(index)?;
        self.invalid_readings = 0;
        self.cancel_measure(Some(index));
        Ok(())
    }

    /// Skips all pending samples, so that the fit uses only the recorded readings. Does nothing without a scan or after
    /// a failure.
    ///
    /// # Errors
    /// Fails like [`Scan::finish_early`].
    pub fn finish_early(&mut self) -> Result<(), SkipError> {
        if self.ignores_readings() {
            return Ok(());
        }
        if let Ok(scan) = &mut self.scan {
            scan.finish_early()?;
            self.invalid_readings = 0;
            self.cancel_measure(None);
        }
        Ok(())
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

    /// Returns true after a failure: a reading would belong to the previous material.
    fn ignores_readings(&self) -> bool {
        matches!(
            self.phase,
            Phase::ReportFailure(_) | Phase::Pause { .. } | Phase::Rest
        )
    }

    /// Ends the scan with a failure.
    pub fn fail(&mut self, failure: Failure) {
        self.is_idle = false;
        self.pending.cancel();
        self.invalid_readings = 0;
        self.next = Some(Action::Failed(failure));
        if failure == Failure::NoReply {
            // The host may return, and its readings are still valid then. The host would not recognize readings that a
            // fit has clamped.
            if let Ok(scan) = &mut self.scan {
                scan.forget_clamped();
            }
            self.phase = Phase::Hello;
            return;
        }
        if let Phase::Store { checksum, .. } | Phase::Stored { checksum, .. } = self.phase {
            self.declined = Some(checksum); // storing it would fail again
        }
        self.forget();
        self.phase = match self.config.host {
            Host::Absent => Phase::Rest,
            Host::Measures | Host::Listens => Phase::ReportFailure(failure),
        };
    }

    /// Begins a scan of the next material.
    pub fn restart(&mut self) {
        self.is_idle = false;
        self.pending.cancel();
        self.forget();
        self.invalid_readings = 0;
        self.next = None;
        self.phase = Phase::Hello;
    }

    fn forget(&mut self) {
        if let Ok(scan) = &mut self.scan {
            scan.restart();
            self.forgets = true;
        }
    }

    /// Does the next unit of work, and returns the next action of the firmware. `now_ms` is the time of a monotonic
    /// clock with any origin, in ms.
    pub fn poll(&mut self, now_ms: u64) -> Action {
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
        let due = match self.phase {
            Phase::Pause { until } => until,
            _ => self.pending.next_deadline()?,
        };
        let delay = due.saturating_sub(now_ms);
        Some(u32::try_from(delay).unwrap_or(u32::MAX))
    }

    fn next_action(&mut self, now: u64) -> Action {
        if let Some(action) = self.next.take() {
            return action;
        }
        if core::mem::take(&mut self.forgets) {
            return Action::Forget;
        }
        match self.pending.poll(now, &self.config) {
            PollResult::Idle => return self.step(now),
            PollResult::Waiting => return Action::Wait,
            PollResult::Reply(request, reply) => self.handle_reply(&request, reply, now),
            PollResult::TimedOut(Request::Failed(_)) => self.pause(now),
            PollResult::TimedOut(_) => self.fail(Failure::NoReply),
        }
        self.next.take().unwrap_or(Action::Continue)
    }

    fn pause(&mut self, now: u64) {
        self.phase = Phase::Pause {
            until: now.saturating_add(PAUSE_MS),
        };
    }
}

impl<K: Fitter> core::fmt::Debug for Driver<'_, K> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Driver")
            .field("phase", &self.phase)
            .field("config", &self.config)
            .finish_non_exhaustive()
    }
}

#[cfg(feature = "defmt")]
impl<K: Fitter> defmt::Format for Driver<'_, K> {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "Driver({}, {})", self.phase, self.config);
    }
}
