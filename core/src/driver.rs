//! What every scanner's firmware does, free of I/O and of time.
//!
//! A [`Driver`] is fed with bytes from the line, readings, and the time that has passed; it says
//! what is to be done next ([`Action`]), and which bytes are to be sent. Motors, sensor, UART, flash
//! and clock are the firmware's, and so is its loop:
//!
//! ```
//! use glimpse_core::driver::{Action, Config, Driver, Host};
//! use glimpse_core::model::Neural;
//! use glimpse_core::recipe::Recipe;
//! use glimpse_core::scan::{Memory, Reading, Scan};
//!
//! let recipe = include_bytes!("../examples/recipes/neural-n8.recipe");
//! let mut memory = Memory::<Neural, 8>::new();
//! let scan = Recipe::parse(recipe).unwrap(); // a firmware hands errors to the driver, see `Driver::new`
//! let scan = Scan::new(scan, &mut memory).unwrap();
//! let mut driver = Driver::new(Ok(scan), Config::new(Host::Absent));
//! loop {
//!     let milliseconds = 1; // since the last turn
//!     match driver.poll(milliseconds) {
//!         Action::Measure { index, .. } => driver.record(index, Reading::new([0.1; 3])),
//!         Action::Finished(residual) => break println!("{}", residual.mean),
//!         Action::Failed(failure) => panic!("{failure}"),
//!         Action::Save { .. } | Action::Forget => {} // flash
//!         Action::Wait { .. } | Action::Continue => {} // sleep, or not
//!         Action::Store { .. } | Action::Install { .. } => {} // of other hosts
//!     }
//! }
//! let scan = driver.scan().unwrap();
//! println!("{:?}", scan.fitted().unwrap().residual());
//! ```

mod action;
mod config;
mod line;
mod phase;
mod replies;

pub use action::Action;
pub use config::{Config, Host};

use crate::fit::Fitter;
use crate::heapless::Vec;
use crate::link::{Failure, PROTOCOL, Request, VALUES_PER_FRAME};
use crate::model::ModelKind;
use crate::scan::{FinishError, Reading, Scan};
use line::{Line, News};
use phase::Phase;

/// A pause after a failure, in milliseconds: whatever it was, it is not tried again in haste.
const PAUSE: u32 = 500;

/// Leads a scan from the first word to the last, and then the next one.
pub struct Driver<'a, K: Fitter> {
    /// Or why there can be none.
    scan: Result<Scan<'a, K>, Failure>,
    config: Config,
    line: Line,
    phase: Phase,
    /// How often the present reading was refused.
    refused: u8,
    /// Kept readings are to be forgotten.
    forgets: bool,
    /// The recipe that was fetched last, and did not serve: it is not fetched again and again.
    declined: Option<u32>,
    /// Said before anything else is done.
    next: Option<Action>,
}

impl<'a, K: Fitter> Driver<'a, K> {
    /// Leads this scan. Readings that outlasted a reset are recorded in it already; a host that
    /// measures is asked whether they still hold.
    ///
    /// If there is no scan, because the recipe is damaged or for another firmware, the driver tells
    /// the host why; and asks it for a better recipe if it can store one.
    #[must_use]
    pub fn new(scan: Result<Scan<'a, K>, Failure>, config: Config) -> Self {
        Self {
            scan,
            config,
            line: Line::new(),
            phase: Phase::Greet,
            refused: 0,
            forgets: false,
            declined: None,
            next: None,
        }
    }

    /// The scan, or why there can be none.
    ///
    /// # Errors
    /// What was given to [`Driver::new`].
    pub fn scan(&self) -> Result<&Scan<'a, K>, Failure> {
        self.scan.as_ref().map_err(|failure| *failure)
    }

    /// The recipe of this checksum is not fetched: it did not serve a driver before this one.
    pub fn decline(&mut self, checksum: u32) {
        self.declined = Some(checksum);
    }

    /// The checksum of the recipe that did not serve last.
    #[must_use]
    pub fn declined(&self) -> Option<u32> {
        self.declined
    }

    /// Takes a byte from the line.
    pub fn receive(&mut self, byte: u8) {
        self.line.receive(byte);
    }

    /// Bytes to be sent; [`Driver::sent`] says how many were.
    #[must_use]
    pub fn outgoing(&self) -> &[u8] {
        self.line.outgoing()
    }

    /// So many of the outgoing bytes were sent.
    pub fn sent(&mut self, count: usize) {
        self.line.sent(count);
    }

    /// Takes the reading of a sample, in any order, from the device's own sensor; one between two
    /// calls of [`Driver::poll`], which says that it is to be kept. A scan that was given up takes
    /// none.
    pub fn record(&mut self, index: u16, reading: Reading) {
        // It would be one of the material before.
        if matches!(
            self.phase,
            Phase::Complain(_) | Phase::Pause { .. } | Phase::Rest
        ) {
            return;
        }
        let Ok(scan) = &mut self.scan else {
            return;
        };
        match scan.record(index, reading) {
            Ok(_) => {
                self.refused = 0;
                self.next = Some(Action::Save { index, reading });
            }
            Err(error) => {
                self.refused = self.refused.saturating_add(1);
                if self.refused >= self.config.attempts {
                    self.fail(Failure::Reading { index, error });
                }
            }
        }
    }

    /// Gives up on the scan, for a reason of the firmware's.
    pub fn fail(&mut self, failure: Failure) {
        self.line.hang_up();
        self.refused = 0;
        self.next = Some(Action::Failed(failure));
        // A host that fell silent may be back soon, and then what it measured holds still.
        if failure != Failure::NoReply
            && let Phase::Store { checksum, .. } | Phase::Stored { checksum, .. } = self.phase
        {
            self.declined = Some(checksum); // it would not be stored next time either
        }
        if failure == Failure::NoReply {
            if let Ok(scan) = &mut self.scan {
                scan.forget_clamped(); // the host would not know them again
            }
            self.phase = Phase::Greet;
            return;
        }
        self.forget();
        self.phase = match self.config.host {
            Host::Absent => Phase::Rest,
            _ => Phase::Complain(failure),
        };
    }

    /// Begins a scan of the next material.
    pub fn restart(&mut self) {
        self.line.hang_up();
        self.forget();
        self.refused = 0;
        self.next = None;
        self.phase = Phase::Greet;
    }

    fn forget(&mut self) {
        self.forgets = true;
        if let Ok(scan) = &mut self.scan {
            scan.restart();
        }
    }

    /// Does what is next, `elapsed` milliseconds after the last call, and says what the firmware has
    /// to do.
    pub fn poll(&mut self, elapsed: u32) -> Action {
        if let Phase::Pause { left } = &mut self.phase {
            *left = left.saturating_sub(elapsed);
        }
        if let Some(action) = self.next.take() {
            return action;
        }
        if core::mem::take(&mut self.forgets) {
            return Action::Forget;
        }
        let patience = match self.phase {
            Phase::Greet => u32::MAX,
            Phase::Measure => self.config.measuring_patience,
            _ => self.config.patience,
        };
        match self.line.news(elapsed, self.config.repeat, patience) {
            News::None { milliseconds } => Action::Wait { milliseconds },
            News::Reply(reply) => {
                self.understand(reply);
                self.next.take().unwrap_or(Action::Continue)
            }
            News::Silence => {
                match self.phase {
                    Phase::Complain(_) => self.phase = Phase::Pause { left: PAUSE },
                    _ => self.fail(Failure::NoReply),
                }
                self.next.take().unwrap_or(Action::Continue)
            }
            News::Free => self.go_on(),
        }
    }

    /// Goes on where no reply is waited for.
    fn go_on(&mut self) -> Action {
        let talks = self.config.host != Host::Absent;
        let scan = match &mut self.scan {
            Ok(scan) => scan,
            Err(failure) if !talks && self.phase == Phase::Greet => {
                let failure = *failure;
                self.fail(failure);
                return Action::Continue;
            }
            Err(_) => return self.go_on_without_scan(),
        };
        match self.phase {
            Phase::Greet if !talks => {
                self.phase = Phase::Measure;
                Action::Continue
            }
            Phase::Greet => {
                let recipe = scan.recipe();
                let (model, samples, recipe) =
                    (recipe.model(), recipe.samples() as u16, recipe.checksum());
                self.ask(Request::Hello {
                    protocol: PROTOCOL,
                    model,
                    samples,
                    recipe,
                })
            }
            Phase::Offer { next } => {
                let samples = scan.recipe().samples() as u16;
                let kept = (next..samples).find_map(|index| Some((index, scan.reading(index)?)));
                match kept {
                    Some((index, reading)) => {
                        self.phase = Phase::Offer { next: index };
                        self.ask(Request::Saved { index, reading })
                    }
                    None => {
                        self.phase = Phase::Measure;
                        Action::Continue
                    }
                }
            }
            Phase::Measure => match scan.next_pending() {
                Some((index, directions)) if self.config.host == Host::Measures => {
                    self.ask(Request::Measure { index, directions })
                }
                Some((index, directions)) => Action::Measure { index, directions },
                None => match scan.fit() {
                    Ok(_) => {
                        self.phase = Phase::Fit;
                        Action::Continue
                    }
                    Err(error) => self.give_up(Failure::Fit(error)),
                },
            },
            Phase::Fit => self.advance(talks),
            Phase::Fitted => {
                self.phase = Phase::Tell { offset: 0 };
                Action::Continue
            }
            Phase::Tell { offset } => self.tell(offset),
            Phase::End => {
                self.forget();
                self.phase = match self.config.host {
                    Host::Measures => Phase::Greet,
                    _ => Phase::Rest,
                };
                Action::Continue
            }
            Phase::Rest => Action::Wait {
                milliseconds: u32::MAX,
            },
            _ => self.go_on_without_scan(),
        }
    }

    /// What needs no scan.
    fn go_on_without_scan(&mut self) -> Action {
        match self.phase {
            Phase::Greet => self.ask(Request::Hello {
                protocol: PROTOCOL,
                model: ModelKind::Linear,
                samples: 0,
                recipe: 0,
            }),
            Phase::Update => self.ask(Request::Update),
            Phase::Store { offset, .. } => self.ask(Request::RecipePart { offset }),
            Phase::Stored { bytes, checksum } => {
                self.declined = Some(checksum); // unless a new driver takes over
                self.phase = self.begin();
                Action::Install { bytes, checksum }
            }
            Phase::Complain(failure) => self.ask(Request::Failed(failure)),
            Phase::Pause { left: 0 } => {
                self.phase = Phase::Greet;
                Action::Continue
            }
            Phase::Pause { left } => Action::Wait { milliseconds: left },
            Phase::Rest => Action::Wait {
                milliseconds: u32::MAX,
            },
            _ => {
                self.phase = Phase::Complain(self.scan().err().unwrap_or(Failure::NoReply));
                Action::Continue
            }
        }
    }

    /// A slice of the fit.
    fn advance(&mut self, talks: bool) -> Action {
        let slice = self.config.slice.max(1);
        let Ok(scan) = &mut self.scan else {
            return Action::Continue;
        };
        let Some(mut fit) = scan.fit_under_way() else {
            self.phase = Phase::Measure; // never: the phase and the scan's stage go together
            return Action::Continue;
        };
        let progress = fit.advance(slice);
        if progress.is_complete() {
            match fit.finish() {
                Ok(_) | Err(FinishError::Implausible(_)) => self.phase = Phase::Fitted,
                Err(FinishError::Diverged) => return self.give_up(Failure::Diverged),
                Err(FinishError::Unfinished(_)) => {} // it is complete
            }
        }
        if talks {
            return self.ask(Request::Progress(progress));
        }
        Action::Continue
    }

    /// The values from `offset` on, or the end.
    fn tell(&mut self, offset: u16) -> Action {
        let fitted = self.scan.as_ref().ok().and_then(Scan::fitted);
        let Some(fitted) = fitted else {
            self.phase = Phase::Measure;
            return Action::Continue;
        };
        let residual = fitted.residual();
        if self.config.host == Host::Absent {
            self.phase = Phase::End;
            return Action::Finished(residual);
        }
        let mut values = Vec::<f32, VALUES_PER_FRAME>::new();
        let mut total = 0_u16;
        for value in fitted.values() {
            if total >= offset {
                let _ = values.push(value); // what finds no room comes next time
            }
            total = total.saturating_add(1);
        }
        if values.is_empty() {
            return self.ask(Request::Finished(residual));
        }
        self.ask(Request::Values {
            offset,
            total,
            values,
        })
    }

    /// Sends a request.
    fn ask(&mut self, request: Request) -> Action {
        self.line.ask(request);
        Action::Wait {
            milliseconds: self.config.repeat,
        }
    }

    fn give_up(&mut self, failure: Failure) -> Action {
        self.fail(failure);
        self.next.take().unwrap_or(Action::Continue)
    }
}
