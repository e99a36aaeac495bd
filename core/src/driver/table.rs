//! The states of a driver, and the only function that changes them.

use super::Host;
use crate::error::{Error, ErrorCode};

/// A driver works toward this with a host or alone. A failure does not change it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Task {
    /// The fit of all readings.
    Scan,
    /// The host's acceptance of the result.
    Publish,
    /// Nothing: the host has the result, and the firmware decides about the next scan.
    Rest,
}

/// The state of a driver. Arms move in [`State::Read`] only.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum State {
    /// Sends `Hello`, after a pause.
    Hello,
    /// Offers restored readings to a host that measures, from index `next` on.
    Offer {
        /// The first index that was not offered.
        next: u16,
    },
    /// Reads the samples.
    Read,
    /// Fits the readings.
    Fit,
    /// Sends the fitted values, and then the residual.
    Send {
        /// The first value that the host has not accepted.
        next: u16,
    },
    /// The task is complete.
    Rest,
    /// Reports a failure to the host.
    Report {
        /// The failure.
        error: Error,
        /// True if the firmware gave a command since the failure.
        goes_on: bool,
    },
    /// A failure is reported, as far as there is a host. Nothing happens until a command.
    Halted,
}

/// An event that changes the state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// The host has carried out the request, or no host exists.
    Accepted,
    /// The host has accepted values.
    Received {
        /// The first value that it has not accepted.
        next: u16,
    },
    /// The state's work is done.
    Done,
    /// The host does not reply.
    Silent,
    /// The host refuses the request.
    Refused(ErrorCode),
    /// The firmware or a step has failed.
    Failed(Error),
    /// The firmware continues after a failure.
    Resume,
    /// The firmware begins the next material.
    Restart,
}

/// The effect of a transition, in addition to the new state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Effect {
    /// Nothing else.
    None,
    /// The host is not connected: go on without it, as long as it only listens.
    Disconnect,
    /// As [`Effect::Disconnect`], and the next `Hello` comes after a longer pause.
    Pause,
    /// The next report comes after a longer pause.
    PauseReport,
    /// Delete the readings, which are not valid.
    Clear,
    /// Show the result: its fit is complete.
    Finish,
    /// The host has the result: the readings need not survive a reset.
    Publish,
    /// Show the failure, and drop the pending request.
    Halt(Error),
}

/// The facts that a transition depends on, in addition to state and event.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facts {
    /// The role of the host.
    pub host: Host,
    /// The task.
    pub task: Task,
    /// True if the host has not replied to an earlier report of the present failure.
    pub is_report_lost: bool,
}

/// Returns the next state and what else to do. After [`Event::Failed`], only [`Event::Resume`] and [`Event::Restart`] lead
/// back to states in which something moves.
#[must_use]
pub fn next(state: State, event: Event, facts: Facts) -> (State, Effect) {
    use Event::{Accepted, Done, Failed, Received, Refused, Restart, Resume, Silent};
    use State::{Fit, Halted, Hello, Offer, Read, Report, Rest, Send};
    let Facts { host, task, .. } = facts;
    let listens = host == Host::Listens;
    let again = if task == Task::Rest { Rest } else { Hello };
    let after_hello = match task {
        Task::Scan if host == Host::Measures => Offer { next: 0 },
        Task::Scan => Read,
        Task::Publish => Send { next: 0 },
        Task::Rest => Rest,
    };
    match (state, event) {
        (_, Failed(error)) => fail(host, error),
        // A report goes first, unless nobody replies to it.
        (Report { error, .. }, Resume | Restart) if !facts.is_report_lost => {
            let goes_on = true;
            (Report { error, goes_on }, Effect::None)
        }
        (Halted | Report { .. }, Resume) | (_, Restart) => (again, Effect::None),
        (_, Resume) => (state, Effect::None),

        (Report { goes_on: true, .. }, _) => (again, Effect::None),
        (Report { .. }, Silent) => (state, Effect::PauseReport),
        (Report { .. } | Halted, _) => (Halted, Effect::None),

        (Offer { .. }, Refused(ErrorCode::RefusedRestored)) => (Read, Effect::Clear),
        // A host that listens was restarted. It receives the result after another hello.
        (Fit | Send { .. }, Refused(ErrorCode::RefusedNoScan)) if listens => {
            (state, Effect::Disconnect)
        }
        (_, Refused(code)) => fail(host, Error::with(code, [code.number().into(), 0])),

        // A host that listens is optional, one that measures is not.
        (Hello, Silent) if listens && task == Task::Publish => (Hello, Effect::Pause),
        (Hello, Silent) if listens => (after_hello, Effect::Disconnect),
        (Fit | Send { .. }, Silent) if listens => (state, Effect::Disconnect),
        (_, Silent) => fail(host, Error::new(ErrorCode::NoReply)),

        (Hello, Accepted) => (after_hello, Effect::None),
        (Offer { next }, Accepted) => {
            let next = next.saturating_add(1);
            (Offer { next }, Effect::None)
        }
        (Offer { .. }, Done) => (Read, Effect::None),
        (Read, Done) => (Fit, Effect::None),
        (Fit, Done) => (Send { next: 0 }, Effect::Finish),
        (Send { .. }, Received { next }) => (Send { next }, Effect::None),
        // Nobody is there to receive the result.
        (Send { .. }, Done) => (Hello, Effect::Pause),
        (Send { .. }, Accepted) if host == Host::Measures => (Hello, Effect::Publish),
        (Send { .. }, Accepted) => (Rest, Effect::Publish),

        // Replies without an effect on the state, such as those to progress.
        (_, Accepted | Received { .. } | Done) => (state, Effect::None),
    }
}

/// A failure: nothing moves until a command. A host that does not reply receives no report of that.
fn fail(host: Host, error: Error) -> (State, Effect) {
    let state = match host == Host::Absent || error.code == ErrorCode::NoReply {
        true => State::Halted,
        false => State::Report {
            error,
            goes_on: false,
        },
    };
    (state, Effect::Halt(error))
}
