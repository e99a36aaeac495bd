//! Properties of the driver's table, for every state, event and situation.

use glimpse_core::driver::Host;
use glimpse_core::driver::table::{Effect, Event, Facts, State, Task, next};
use glimpse_core::error::{Error, ErrorCode};

const ERROR: Error = Error::new(ErrorCode::Machine);

fn states() -> Vec<State> {
    let reports = [false, true].map(|goes_on| State::Report {
        error: ERROR,
        goes_on,
    });
    let others = [
        State::Hello,
        State::Offer { next: 2 },
        State::Read,
        State::Fit,
        State::Send { next: 16 },
        State::Rest,
        State::Halted,
    ];
    reports.into_iter().chain(others).collect()
}

const EVENTS: [Event; 10] = [
    Event::Accepted,
    Event::Received { next: 32 },
    Event::Done,
    Event::Silent,
    Event::Refused(ErrorCode::RefusedNoScan),
    Event::Refused(ErrorCode::RefusedRestored),
    Event::Refused(ErrorCode::RefusedModel),
    Event::Failed(ERROR),
    Event::Resume,
    Event::Restart,
];

fn situations() -> Vec<Facts> {
    let hosts = [Host::Measures, Host::Listens, Host::Absent];
    let tasks = [Task::Scan, Task::Publish, Task::Rest];
    let mut all = Vec::new();
    for (host, task) in hosts
        .into_iter()
        .flat_map(|host| tasks.map(|task| (host, task)))
    {
        all.extend([false, true].map(|is_report_lost| Facts {
            host,
            task,
            is_report_lost,
        }));
    }
    all
}

/// Nothing moves after a failure until a command: no event but a command leads out of the states after it.
#[test]
fn only_commands_end_a_failure() {
    let is_failed = |state| matches!(state, State::Halted | State::Report { goes_on: false, .. });
    for state in states() {
        for event in EVENTS {
            for facts in situations() {
                let (after, effect) = next(state, event, facts);
                let is_command = matches!(event, Event::Resume | Event::Restart);
                if is_failed(state) && !is_command {
                    assert!(is_failed(after), "{state:?} {event:?} {facts:?}");
                }
                // Each failure is shown, once.
                let is_new =
                    is_failed(after) && (!is_failed(state) || event == Event::Failed(ERROR));
                assert_eq!(
                    matches!(effect, Effect::Halt(_)),
                    is_new,
                    "{state:?} {event:?}"
                );
                // Arms move only after a hello, or its absence.
                if after == State::Read && state != State::Read {
                    assert!(matches!(state, State::Hello | State::Offer { .. }));
                    assert!(facts.task == Task::Scan || state != State::Hello);
                }
                // Readings are deleted only for their host, or after it has the result.
                match effect {
                    Effect::Publish => assert!(matches!(state, State::Send { .. })),
                    Effect::Clear => assert!(matches!(state, State::Offer { .. })),
                    _ => {}
                }
            }
        }
    }
}
