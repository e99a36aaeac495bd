//! The next step of a driver without a pending request.

use super::phase::Phase;
use super::{Action, Driver, Host};
use crate::error::Error;
use crate::fit::ScanModel;
use crate::gonio::Reading;
use crate::link::{PROTOCOL, Request, Values};
use crate::model::ModelKind;
use crate::scan::Fitted;

impl<K: ScanModel> Driver<'_, K> {
    /// Does the next step of the phase.
    pub(super) fn step(&mut self, now: u64) -> Action {
        match self.phase {
            Phase::Hello => self.hello(now),
            Phase::Update => self.request(Request::Update, now),
            Phase::Store { offset, .. } => self.request(Request::RecipePart { offset }, now),
            Phase::Stored { bytes, checksum } => {
                // Not again, unless the firmware reports that it could not store the recipe.
                self.declined = Some(checksum);
                self.phase = Phase::Installed;
                Action::Install { bytes, checksum }
            }
            Phase::Installed => {
                self.begin();
                Action::Continue
            }
            Phase::Offer { next } => match self.recorded_from(next) {
                Some((index, reading)) => self.request(Request::Saved { index, reading }, now),
                None => {
                    self.begin_scan();
                    Action::Continue
                }
            },
            Phase::Scan => self.step_scan(now),
            Phase::Published => {
                self.is_published = true;
                self.phase = match self.config.host {
                    Host::Measures => {
                        self.reset_scan();
                        Phase::Hello
                    }
                    Host::Listens | Host::Absent => {
                        self.forget();
                        Phase::Rest
                    }
                };
                Action::Continue
            }
            Phase::ReportFailure(error) => {
                self.wake_at = self.report_pause.end(now);
                match self.wake_at {
                    Some(_) => Action::Wait,
                    None => self.request(Request::Failed(error), now),
                }
            }
            Phase::Rest => Action::Wait,
        }
    }

    /// Sends `Hello` to the host, if there is one.
    fn hello(&mut self, now: u64) -> Action {
        if self.config.host == Host::Absent {
            self.begin();
            return Action::Continue;
        }
        self.wake_at = self.pause.end(now);
        if self.wake_at.is_some() {
            return Action::Wait;
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

    /// Begins after `Hello`. A host that only listens cannot validate recorded readings, so the firmware does this when
    /// it restores them.
    pub(super) fn begin(&mut self) {
        match self.config.host {
            Host::Measures => self.phase = Phase::Offer { next: 0 },
            Host::Listens | Host::Absent => self.begin_scan(),
        }
    }

    /// Fails because there is no scan. It reports that to the host once.
    pub(super) fn fail_without_scan(&mut self, error: Error) {
        if self.is_no_scan_reported {
            self.is_halted = true;
            self.pause.lengthen();
            self.phase = self.phase_after_failure();
        } else {
            self.is_no_scan_reported = true;
            self.fail(error);
        }
    }

    /// The first recorded reading from index `next` on.
    fn recorded_from(&self, next: u16) -> Option<(u16, Reading)> {
        let scan = self.scan.as_ref().ok()?;
        let samples = scan.recipe().samples() as u16;
        (next..samples).find_map(|index| Some((index, scan.reading(index)?)))
    }

    /// Reads, fits or sends values, depending on the state of the scan.
    fn step_scan(&mut self, now: u64) -> Action {
        let Ok(scan) = &mut self.scan else {
            self.phase = Phase::Rest; // `begin_scan` has failed
            return Action::Continue;
        };
        let host = self.config.host;
        let next = scan.next_pending();
        // While samples are pending, a fit checks the target, if its bound holds. Afterwards, a fit is the result.
        let target = self.config.target_loss.filter(|target| {
            let is_bounded = scan.recipe().bounds_partial_loss() && scan.is_prefix();
            *target > 0.0 && next.is_some() && is_bounded
        });
        if let Some(mut fit) = scan.fit_under_way() {
            let progress = fit.advance(self.config.steps_per_poll.max(1));
            if !progress.is_complete() {
                return match target.is_none() && self.is_connected {
                    true => self.request(Request::Progress(progress), now),
                    false => Action::Continue,
                };
            }
            let finished = fit.finish();
            if let Some(target) = target {
                let bound = finished.ok().and_then(|fitted| fitted.loss_bound());
                // The fit stays valid, because it does not use the pending samples.
                let is_reached =
                    bound.is_some_and(|bound| bound <= target) && scan.finish_early().is_ok();
                self.is_target_missed = !is_reached;
            } else if let Err(error) = finished
                && !error.is_implausible()
            {
                return self.fail_now(error);
            } else if self.is_connected {
                return self.request(Request::Progress(progress), now);
            }
            return Action::Continue;
        }
        if target.is_none()
            && let Some(fitted) = scan.fitted()
        {
            if !self.is_finished {
                self.is_finished = true;
                return Action::Finished(fitted.residual());
            }
            if host == Host::Absent {
                self.phase = Phase::Published;
                return Action::Continue;
            }
            if !self.is_connected {
                self.pause.lengthen();
                self.phase = Phase::Hello;
                return Action::Continue;
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
        match scan.fit() {
            Ok(_) => Action::Continue,
            Err(_) if target.is_some() => {
                self.is_target_missed = true;
                Action::Continue
            }
            Err(error) => self.fail_now(error),
        }
    }

    fn request(&mut self, request: Request, now: u64) -> Action {
        self.pending.begin(request, now, &self.config);
        Action::Wait
    }

    fn fail_now(&mut self, error: Error) -> Action {
        self.fail(error);
        self.queued_action().unwrap_or(Action::Continue)
    }
}

/// Returns a request with the values from `offset` on, or with the residual after the last value.
fn values_request<K: ScanModel>(fitted: &Fitted<'_, K>, offset: u16) -> Request {
    let mut values = Values::new();
    let mut total = 0_u16;
    for value in fitted.values() {
        if total >= offset {
            let _ = values.push(value); // the next frame has values that do not fit
        }
        total = total.saturating_add(1);
    }
    if values.is_empty() {
        return Request::Finished(fitted.residual());
    }
    Request::Values {
        offset,
        total,
        values,
    }
}
