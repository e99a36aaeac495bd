//! Every failure is reported to the firmware and to the host, and the scan restarts after a pause.

use std::cell::Cell;

use glimpse_core::driver::{Action, Config, Driver, Host};
use glimpse_core::link::{Failure, PROTOCOL, Refusal, Reply, Request};
use glimpse_core::recipe::RecipeError;
use glimpse_core::scan::{FitError, Reading, ScanError};

use super::bench::{
    AnyDriver, Bench, ORIGIN, default_reply, is_failed, is_finished, is_measure, is_saved,
    new_driver, phong_driver,
};
use crate::recipes::{neural, parsed};
use crate::scanning::{
    Any, MODELS, SAMPLES, full_scan, new_scan, recipe_for, record, synthetic_reading,
};

const HOSTS: [Host; 2] = [Host::Measures, Host::Listens];

/// Checks the steps after a failure: saved readings are deleted, the failure is reported, and after a pause of 500 ms
/// the device sends `Hello` again with all samples pending. A device without a host waits for a restart.
pub(crate) fn check_after_failure(
    host: Host,
    bench: &mut Bench<'_>,
    driver: &mut AnyDriver,
    failure: Failure,
) {
    assert_eq!(bench.actions.last().unwrap().1, Action::Failed(failure));
    let start = bench.now;
    bench.requests.clear();
    bench.frames.clear();
    assert_eq!(bench.step(driver), Action::Forget);
    if host == Host::Absent {
        for _ in 0..3 {
            driver.record(0, synthetic_reading(0));
            bench.now += 1_000_000;
            assert_eq!(driver.poll(ORIGIN + bench.now), Action::Wait);
            assert_eq!(driver.poll_delay(ORIGIN + bench.now), None);
            assert!(driver.outgoing().is_empty());
        }
        return;
    }
    bench.wait(driver, 499);
    assert_eq!(bench.requests, [Request::Failed(failure.into())]);
    assert_eq!(bench.frames.len(), 1);
    // The pause begins when the host has received the report. A reading during the pause belongs to the failed scan.
    driver.record(0, synthetic_reading(0));
    while bench.requests.len() < 2 {
        bench.step(driver);
    }
    assert!(matches!(bench.requests[1], Request::Hello { .. }));
    assert_eq!(bench.frames[1].0, start + 500);
    assert_eq!(driver.scan().unwrap().pending().count(), SAMPLES);
}

/// Checks that a host that answers some requests wrongly causes `failure`. When the host answers correctly again, the
/// scan finishes.
pub(crate) fn check_failure(
    host: Host,
    wrong: impl Fn(&Request) -> Option<Reply>,
    failure: Failure,
) {
    let mut driver = phong_driver(Config::new(host));
    let healed = Cell::new(false);
    let mut bench = Bench::new(|request| {
        let wrong = wrong(request).filter(|_| !healed.get());
        Some(wrong.unwrap_or_else(|| default_reply(request)))
    });
    bench.run(&mut driver, is_failed);
    healed.set(true);
    check_after_failure(host, &mut bench, &mut driver, failure);
    bench.run(&mut driver, is_finished);
    let expected = full_scan::<Any>(*driver.scan().unwrap().recipe(), synthetic_reading);
    assert_eq!(bench.results(), (expected.bits().to_vec(), 1));
}

#[test]
fn refused_request_fails() {
    type Refused = fn(&Request) -> bool;
    let cases: [(&[Host], Refused); 5] = [
        (&HOSTS[..1], |r| matches!(r, Request::Hello { .. })),
        (&HOSTS[..1], |r| {
            matches!(r, Request::Measure { index: 3, .. })
        }),
        (&HOSTS, |r| matches!(r, Request::Progress(_))),
        (&HOSTS, |r| matches!(r, Request::Values { .. })),
        (&HOSTS, |r| matches!(r, Request::Finished(_))),
    ];
    for refusal in [
        Refusal::NoScan,
        Refusal::Directions,
        Refusal::Values,
        Refusal::Model,
    ] {
        for (hosts, is_refused) in cases {
            for host in hosts {
                let refuse = |r: &Request| is_refused(r).then_some(Reply::Refused(refusal));
                check_failure(*host, refuse, Failure::Refused(refusal));
            }
        }
    }
}

#[test]
fn other_protocol_fails() {
    for protocol in [PROTOCOL - 1, PROTOCOL + 1, 0, u16::MAX] {
        let failure = Failure::Protocol {
            device: PROTOCOL,
            host: protocol,
        };
        for host in HOSTS {
            let welcome = |r: &Request| {
                matches!(r, Request::Hello { .. }).then_some(Reply::Welcome { protocol })
            };
            check_failure(host, welcome, failure);
        }
    }
}

/// The report of a failure may be lost or refused too. The device sends `Hello` after a pause.
#[test]
fn failure_report_times_out() {
    for refuses in [false, true] {
        let mut driver = phong_driver(Config::new(Host::Measures));
        let mut bench = Bench::new(|request| match request {
            Request::Measure { .. } => Some(Reply::Refused(Refusal::Directions)),
            Request::Failed(_) if refuses => Some(Reply::Refused(Refusal::NoScan)),
            Request::Failed(_) => None,
            _ => Some(default_reply(request)),
        });
        bench.run(&mut driver, is_failed);
        bench.frames.clear();
        bench.requests.clear();
        while bench.requests.len() < 2 {
            bench.step(&mut driver);
        }
        assert_eq!(bench.now, if refuses { 500 } else { 2_500 });
        let [Request::Failed(_), Request::Hello { .. }] = bench.requests[..] else {
            panic!("{:?}", bench.requests)
        };
        let (_, report) = &bench.frames[0];
        let reports = bench.frames.iter().take_while(|(_, frame)| frame == report);
        assert_eq!(reports.count(), if refuses { 1 } else { 20 });
        // One failure for each attempt.
        let failed = bench.take_actions();
        assert_eq!(failed.iter().filter(|action| is_failed(action)).count(), 1);
    }
}

#[test]
fn refused_saved_reading_restarts_scan() {
    for model in MODELS {
        let recipe = recipe_for(model);
        let mut scan = new_scan::<Any>(recipe);
        // The second saved reading belongs to another material.
        record(&mut scan, 2..6, |index| {
            synthetic_reading(if index == 3 { 7 } else { index })
        });
        let mut driver = Driver::new(scan, Config::new(Host::Measures));
        let mut bench = Bench::cooperative();
        bench.run(&mut driver, is_finished);
        assert_eq!((bench.count(is_saved), bench.count(is_measure)), (2, 8));
        assert_eq!(
            bench.results().0,
            full_scan::<Any>(recipe, synthetic_reading).bits()
        );
        let actions = bench.take_actions();
        assert_eq!(actions[0], Action::Forget);
        assert!(!actions[1..].contains(&Action::Forget));
    }
}

#[test]
fn machine_failure_is_reported() {
    for host in [Host::Measures, Host::Listens, Host::Absent] {
        let mut driver = phong_driver(Config::new(host));
        let mut bench = Bench::cooperative();
        while driver.scan().unwrap().pending().count() > 4 {
            bench.step(&mut driver);
        }
        driver.fail(Failure::Machine);
        // A late reading does not hide the failure.
        driver.record(7, synthetic_reading(7));
        assert!(is_failed(&bench.step(&mut driver)));
        check_after_failure(host, &mut bench, &mut driver, Failure::Machine);
        if host == Host::Absent {
            driver.restart();
            assert_eq!(bench.step(&mut driver), Action::Forget);
            assert_eq!(driver.scan().unwrap().pending().count(), SAMPLES);
        }
        bench.run(&mut driver, is_finished);
    }
}

#[test]
fn raw_counts_fail() {
    let counts = |request: &Request| match request {
        Request::Measure { index, .. } => Some(Reply::Measured {
            index: *index,
            reading: Reading::monochrome(1_000.0 + f32::from(*index)),
        }),
        _ => None,
    };
    let failure = Failure::Fit(FitError::TooLarge { limit: 10 });
    check_failure(Host::Measures, counts, failure);
}

#[test]
fn diverged_fit_fails() {
    let mut numbers = neural();
    numbers.step_sizes.fill(1e30);
    let recipe = parsed(numbers.write().unwrap());
    for host in [Host::Measures, Host::Listens, Host::Absent] {
        let mut driver = new_driver::<Any>(recipe, Config::new(host));
        let mut bench = Bench::cooperative();
        bench.run(&mut driver, is_failed);
        check_after_failure(host, &mut bench, &mut driver, Failure::Diverged);
    }
}

/// A device without a scan reports the reason repeatedly, with pauses.
#[test]
fn unusable_recipe_is_reported() {
    let memory = ScanError::Memory {
        needed: 80,
        found: 8,
    };
    for failure in [
        Failure::Recipe(RecipeError::Checksum),
        Failure::Scan(memory),
    ] {
        for host in HOSTS {
            let mut driver = AnyDriver::without_scan(failure, Config::new(host));
            let mut bench = Bench::cooperative();
            bench.wait(&mut driver, 2_000);
            assert_eq!(bench.requests.len(), 8, "{:?}", bench.requests);
            for pair in bench.requests.chunks(2) {
                assert!(matches!(
                    pair[0],
                    Request::Hello {
                        samples: 0,
                        recipe: 0,
                        ..
                    }
                ));
                assert_eq!(pair[1], Request::Failed(failure.into()));
            }
            assert_eq!(driver.scan().err(), Some(failure));
            driver.record(0, synthetic_reading(0));
            driver.restart();
            bench.wait(&mut driver, 1_000);
            assert!(!bench.actions.iter().any(|(_, action)| is_finished(action)));
        }
        let mut driver = AnyDriver::without_scan(failure, Config::new(Host::Absent));
        for _ in 0..2 {
            let actions: Vec<_> = (0..6).map(|_| driver.poll(10)).collect();
            let failures = actions.iter().filter(|action| is_failed(action));
            assert_eq!(failures.count(), 1, "{actions:?}");
            assert!(actions.contains(&Action::Failed(failure)));
            assert_eq!(actions.last(), Some(&Action::Wait));
            assert_eq!(driver.poll_delay(10), None);
            driver.restart();
        }
    }
}
