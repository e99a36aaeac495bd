//! The work of each state, and the host's replies.

use super::table::{Effect, Event, Facts, State, Task, next};
use super::{Action, Driver, Flash, Host};
use crate::error::{Error, ErrorCode};
use crate::fit::ScanModel;
use crate::gonio::Reading;
use crate::link::{PROTOCOL, Purpose, Reply, Request, VALUES_PER_FRAME, Values};
use crate::scan::Fitted;

impl<K: ScanModel> Driver<'_, K> {
    /// Changes the state after an event, and carries out the effect.
    pub(super) fn apply(&mut self, event: Event) {
        let before = self.state;
        let facts = Facts {
            host: self.config.host,
            task: self.task,
            is_report_lost: self.report_pause.has_failed(),
        };
        let (state, effect) = next(before, event, facts);
        self.state = state;
        self.is_connected &= !matches!(effect, Effect::Disconnect | Effect::Pause);
        match effect {
            Effect::None | Effect::Disconnect => {}
            Effect::Pause => self.pause.lengthen(),
            Effect::PauseReport => self.report_pause.lengthen(),
            Effect::Clear => self.clear(),
            Effect::Finish => {
                let evidence = self.proof.evidence(self.scan.mean_reading());
                self.scan.add_evidence(evidence, self.config.limits);
                let residual = self.scan.fitted().map(|fitted| fitted.residual());
                self.queued = residual.map(Action::Finished);
                self.task = Task::Publish;
            }
            Effect::Publish => {
                self.pause.reset();
                match self.config.host {
                    Host::Measures => self.clear(),
                    Host::Listens | Host::Absent => {
                        self.forget();
                        self.task = Task::Rest;
                    }
                }
            }
            Effect::Halt(error) => {
                if matches!(self.queued, Some(Action::Finished(_))) {
                    self.task = Task::Scan; // it was not shown
                }
                self.request.cancel();
                self.asked = None;
                self.report_pause.reset();
                if !error.code.is_machine() {
                    self.pause.lengthen();
                }
                self.queued = Some(Action::Failed(error));
            }
        }
        if state == State::Read && before != State::Read {
            self.check_reach();
        }
    }

    /// Deletes all readings, for a new scan.
    pub(super) fn clear(&mut self) {
        self.scan.restart();
        self.proof = Default::default();
        self.asked = None;
        self.is_target_missed = false;
        self.task = Task::Scan;
        self.forget();
    }

    /// Lets the firmware delete its saved readings, if it has any.
    fn forget(&mut self) {
        if self.flash == Flash::Saved {
            self.flash = Flash::Forget;
        }
    }

    /// Skips samples that the machine does not reach.
    fn check_reach(&mut self) {
        let (Some(machine), None) = (&self.config.machine, self.scan.fitted()) else {
            return;
        };
        let recipe = *self.scan.recipe();
        let mut first = None;
        let mut count: u16 = 0;
        let mut is_tolerated = true;
        for (index, directions) in recipe.directions() {
            if self.scan.reading(index).is_some() || machine.check(&directions).is_ok() {
                continue;
            }
            first = first.or(Some(index));
            count = count.saturating_add(1);
            is_tolerated &= self.scan.skip(index).is_ok();
        }
        if let Some(index) = first
            && (!is_tolerated || usize::from(count) == recipe.samples())
        {
            let details = [index.into(), count.into()];
            self.apply(Event::Failed(Error::with(ErrorCode::OutOfReach, details)));
        }
    }

    /// Does the next work of the state, without a pending request.
    pub(super) fn step(&mut self, now: u64) -> Action {
        match self.state {
            State::Hello => self.hello(now),
            State::Offer { next } => match self.recorded_from(next) {
                Some((index, reading)) => self.send(Request::Restored { index, reading }, now),
                None => self.done(Event::Done),
            },
            State::Read => self.read(now),
            State::Fit => self.fit(now),
            State::Send { next } => match (self.config.host, self.scan.fitted()) {
                (Host::Absent, _) => self.done(Event::Accepted),
                (_, Some(fitted)) if self.is_connected => {
                    let request = values_request(&fitted, next);
                    self.send(request, now)
                }
                _ => self.done(Event::Done),
            },
            State::Report { error, .. } => {
                self.wake_at = self.report_pause.end(now);
                match self.wake_at {
                    Some(_) => Action::Wait,
                    None => self.send(Request::Failed(error), now),
                }
            }
            State::Rest | State::Halted => Action::Wait,
        }
    }

    /// Sends `Hello` to the host, if there is one.
    fn hello(&mut self, now: u64) -> Action {
        if self.config.host == Host::Absent {
            return self.done(Event::Accepted);
        }
        self.wake_at = self.pause.end(now);
        if self.wake_at.is_some() {
            return Action::Wait;
        }
        let recipe = self.scan.recipe();
        let hello = Request::Hello {
            protocol: PROTOCOL,
            model: recipe.model(),
            samples: recipe.samples() as u16,
            recipe: recipe.checksum(),
        };
        self.send(hello, now)
    }

    /// The first recorded reading from index `next` on.
    fn recorded_from(&self, next: u16) -> Option<(u16, Reading)> {
        let samples = self.scan.recipe().samples() as u16;
        (next..samples).find_map(|index| Some((index, self.scan.reading(index)?)))
    }

    /// Requests the next reading. Before it, a fit of the earlier ones may reach the target loss.
    fn read(&mut self, now: u64) -> Action {
        if let Some(target) = self.due_target() {
            let Some(progress) = self.advance_fit() else {
                self.is_target_missed = self.scan.fit().is_err();
                return Action::Continue;
            };
            if progress.is_complete() {
                let fit = self.scan.fit_under_way().and_then(|fit| fit.finish().ok());
                let bound = fit.and_then(|fitted| fitted.loss_bound());
                // The fit stays valid, because it does not use the pending samples.
                let is_reached =
                    bound.is_some_and(|bound| bound <= target) && self.scan.finish_early().is_ok();
                self.is_target_missed = !is_reached;
            }
            return Action::Continue;
        }
        let next = self.proof.next(&self.scan, self.config.limits);
        let Some((purpose, index, directions)) = next else {
            return self.done(Event::Done);
        };
        self.asked = Some((purpose, index));
        match self.config.host {
            Host::Measures => {
                let request = Request::Measure {
                    purpose,
                    index,
                    directions,
                };
                self.send(request, now)
            }
            Host::Listens | Host::Absent => Action::Measure {
                purpose,
                index,
                directions,
            },
        }
    }

    /// The target loss, if a fit of the readings so far has to be compared with it, and its bound holds.
    fn due_target(&self) -> Option<f32> {
        let target = self.config.target_loss.filter(|target| *target > 0.0)?;
        let scan = &self.scan;
        let is_bounded = scan.recipe().bounds_partial_loss() && scan.is_prefix();
        let is_partial = scan.next_pending().is_some() && scan.recorded() > 0;
        (is_bounded && is_partial && !self.is_target_missed).then_some(target)
    }

    /// Advances the fit under way. None if there is none.
    fn advance_fit(&mut self) -> Option<crate::fit::Progress> {
        let mut fit = self.scan.fit_under_way()?;
        Some(fit.advance(self.config.steps_per_poll.max(1)))
    }

    fn fit(&mut self, now: u64) -> Action {
        if self.scan.fitted().is_some() {
            return self.done(Event::Done);
        }
        let Some(progress) = self.advance_fit() else {
            return match self.scan.fit().err() {
                Some(error) => self.done(Event::Failed(error)),
                None => Action::Continue,
            };
        };
        if progress.is_complete() {
            let fit = self.scan.fit_under_way();
            let error = fit.and_then(|fit| fit.finish().err());
            if let Some(error) = error.filter(|error| !error.is_implausible()) {
                return self.done(Event::Failed(error));
            }
        }
        match self.is_connected {
            true => self.send(Request::Progress(progress), now),
            false => Action::Continue,
        }
    }

    fn send(&mut self, request: Request, now: u64) -> Action {
        self.request.begin(request, now, &self.config);
        Action::Wait
    }

    fn done(&mut self, event: Event) -> Action {
        self.apply(event);
        Action::Continue
    }

    /// Handles the reply to a request.
    pub(super) fn handle_reply(&mut self, request: &Request, reply: Reply) {
        self.is_connected = true;
        match (request, reply) {
            (Request::Measure { index, purpose, .. }, Reply::Refused(code))
                if code == ErrorCode::RefusedDirections
                    && (*purpose != Purpose::Sample || self.scan.recipe().tolerates_missing()) =>
            {
                self.skip_or_fail(*index);
            }
            (_, Reply::Refused(code)) => self.apply(Event::Refused(code)),
            (Request::Hello { .. }, Reply::Welcome { protocol }) if protocol != PROTOCOL => {
                let details = [PROTOCOL.into(), protocol.into()];
                let error = Error::with(ErrorCode::Protocol, details);
                self.apply(Event::Failed(error));
            }
            // After an invalid reading, the driver requests the sample again, skips it, or has failed.
            (_, Reply::Measured { index, reading }) => _ = self.record(index, reading),
            (_, Reply::Skip { index }) => self.skip_or_fail(index),
            (_, Reply::FinishEarly) => {
                let finished = self.finish_early();
                finished.unwrap_or_else(|error| self.apply(Event::Failed(error)));
            }
            (Request::Progress(_), _) => {}
            (Request::Values { offset, values, .. }, _) => {
                let next = offset.saturating_add(values.len() as u16);
                self.apply(Event::Received { next });
            }
            _ => self.apply(Event::Accepted),
        }
    }

    fn skip_or_fail(&mut self, index: u16) {
        let skipped = self.skip(index);
        skipped.unwrap_or_else(|error| self.apply(Event::Failed(error)));
    }
}

/// Returns a request with the values from `offset` on, or with the residual after the last value.
fn values_request<K: ScanModel>(fitted: &Fitted<'_, K>, offset: u16) -> Request {
    let mut values = Values::new();
    for value in fitted.values().skip(offset.into()).take(VALUES_PER_FRAME) {
        let _ = values.push(value); // as many fit
    }
    match values.is_empty() {
        true => Request::Finished(fitted.residual()),
        false => Request::Values {
            offset,
            total: fitted.values().count() as u16,
            values,
        },
    }
}
