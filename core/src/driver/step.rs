//! The next step of a driver without a pending request.

use super::phase::Phase;
use super::{Action, Driver, Host};
use crate::fit::Fitter;
use crate::link::{Failure, PROTOCOL, Request, VALUES_PER_FRAME, Values};
use crate::model::ModelKind;
use crate::scan::{FinishError, Fitted, Reading};

impl<K: Fitter> Driver<'_, K> {
    /// Does the next step of the phase.
    pub(super) fn step(&mut self, now: u64) -> Action {
        match self.phase {
            Phase::Hello => self.hello(now),
            Phase::Update => self.request(Request::Update, now),
            Phase::Store { offset, .. } => self.request(Request::RecipePart { offset }, now),
            Phase::Stored { bytes, checksum } => {
                self.declined = Some(checksum); // unless a new driver takes over
                self.begin();
                Action::Install { bytes, checksum }
            }
            Phase::Offer { next } => match self.saved_reading(next) {
                Some((index, reading)) => self.request(Request::Saved { index, reading }, now),
                None => {
                    self.begin_scan();
                    Action::Continue
                }
            },
            Phase::Scan => self.step_scan(now),
            Phase::End => {
                self.forget();
                self.phase = match self.config.host {
                    Host::Measures => Phase::Hello,
                    Host::Listens | Host::Absent => Phase::Rest,
                };
                Action::Continue
            }
            Phase::ReportFailure(failure) => self.request(Request::Failed(failure.into()), now),
            Phase::Pause { until } if now >= until => {
                self.phase = Phase::Hello;
                Action::Continue
            }
            Phase::Pause { .. } | Phase::Rest => Action::Wait,
        }
    }

    /// Sends `Hello` to the host, if there is one.
    fn hello(&mut self, now: u64) -> Action {
        if self.config.host == Host::Absent {
            self.begin();
            return Action::Continue;
        }
        let (model, samples, recipe) = match &self.scan {
            Ok(scan) => {
                let recipe = scan.recipe();
                (recipe.model(), recipe.samples() as u16, recipe.checksum())
            }
            Err(_) => (ModelKind::Linear, 0, 0),
        };
        let protocol = PROTOCOL;
        self.request(
            Request::Hello {
                protocol,
                model,
                samples,
                recipe,
            },
            now,
        )
    }

    /// Begins after `Hello`. A host that only listens cannot validate saved readings, so the firmware does this when it
    /// records them.
    pub(super) fn begin(&mut self) {
        match self.config.host {
            Host::Measures => self.phase = Phase::Offer { next: 0 },
            Host::Listens | Host::Absent => self.begin_scan(),
        }
    }

    /// The first recorded reading from index `next` on.
    fn saved_reading(&self, next: u16) -> Option<(u16, Reading)> {
        let scan = self.scan.as_ref().ok()?;
        let samples = scan.recipe().samples() as u16;
        (next..samples).find_map(|index| Some((index, scan.reading(index)?)))
    }

    /// Reads, fits or sends values, depending on the state of the scan.
    fn step_scan(&mut self, now: u64) -> Action {
        let scan = match &mut self.scan {
            Ok(scan) => scan,
            Err(failure) => {
                let failure = *failure;
                return self.fail_now(failure);
            }
        };
        let host = self.config.host;
        let next = scan.next_pending();
        // While samples are pending, a fit checks the target. Afterwards, a fit is the result.
        let can_stop = next.is_some() && scan.recipe().bounds_partial_loss();
        let target = self.config.target_loss;
        let target = target.filter(|target| can_stop && *target > 0.0);
        if let Some(mut fit) = scan.fit_under_way() {
            let progress = fit.advance(self.config.steps_per_poll.max(1));
            let finished = fit.finish();
            if let Some(target) = target {
                let is_unfinished = matches!(finished, Err(FinishError::Unfinished(_)));
                let bound = finished.ok().and_then(|fitted| fitted.loss_bound());
                // The fit stays valid, because it does not use the pending samples.
                let is_reached =
                    bound.is_some_and(|bound| bound <= target) && scan.finish_early().is_ok();
                self.is_target_missed = !(is_unfinished || is_reached);
                return Action::Continue;
            }
            if let Err(FinishError::Diverged) = finished {
                return self.fail_now(Failure::Diverged);
            }
            return match host {
                Host::Absent => Action::Continue,
                Host::Measures | Host::Listens => self.request(Request::Progress(progress), now),
            };
        }
        if target.is_none()
            && let Some(fitted) = scan.fitted()
        {
            if host == Host::Absent {
                self.phase = Phase::End;
                return Action::Finished(fitted.residual());
            }
            let request = values_request(&fitted, self.values_sent);
            return self.request(request, now);
        }
        if let Some((index, directions)) = next
            && (target.is_none() || self.is_target_missed)
        {
            return match host {
                Host::Measures => self.request(Request::Measure { index, directions }, now),
                Host::Listens | Host::Absent => Action::Measure { index, directions },
            };
        }
        self.values_sent = 0;
        match scan.fit() {
            Ok(_) => Action::Continue,
            Err(_) if target.is_some() => {
                self.is_target_missed = true;
                Action::Continue
            }
            Err(error) => self.fail_now(Failure::Fit(error)),
        }
    }

    fn request(&mut self, request: Request, now: u64) -> Action {
        self.pending.begin(request, now, &self.config);
        Action::Wait
    }

    fn fail_now(&mut self, failure: Failure) -> Action {
        self.fail(failure);
        self.next.take().unwrap_or(Action::Continue)
    }
}

/// Returns a request with the values from `offset` on, or with the residual after the last value.
fn values_request<K: Fitter>(fitted: &Fitted<'_, K>, offset: u16) -> Request {
    let mut buffer = [0.0; VALUES_PER_FRAME];
    let mut count = 0;
    let mut total = 0_u16;
    for value in fitted.values() {
        if total >= offset
            && let Some(place) = buffer.get_mut(count)
        {
            *place = value;
            count = count.saturating_add(1);
        }
        total = total.saturating_add(1);
    }
    if count == 0 {
        return Request::Finished(fitted.residual());
    }
    Request::Values {
        offset,
        total,
        values: Values::take_from(buffer.into_iter().take(count)),
    }
}
