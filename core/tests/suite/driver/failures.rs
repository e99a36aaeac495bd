//! Every failure is reported by name, to the firmware and to the host, and retried after a pause.

use std::cell::Cell;

use glimpse_core::driver::{Action, Config, Driver, Host};
use glimpse_core::link::{Failure, PROTOCOL, Refusal, Reply, Request};
use glimpse_core::recipe::RecipeError;
use glimpse_core::scan::{FitError, Reading, ScanError};

use super::bench::{
    AnyDriver, Bench, ORIGIN, answer, driver_by, is_failed, is_finished, is_kept, is_measure, phong,
};
use crate::recipes::{neural, parsed};
use crate::scanning::{Any, MODELS, SAMPLES, material, recipe_of, record, scan_by, whole};

const HOSTS: [Host; 2] = [Host::Measures, Host::Listens];

/// After the failure: kept readings are forgotten, the failure is reported, half a second is rest, and
/// then the host is greeted again, all to be measured. A device without a host rests until a restart.
pub(crate) fn check_aftermath(
    host: Host,
    bench: &mut Bench<'_>,
    driver: &mut AnyDriver,
    failure: Failure,
) {
    assert_eq!(bench.actions.last().unwrap().1, Action::Failed(failure));
    let start = bench.now;
    bench.heard.clear();
    bench.frames.clear();
    assert_eq!(bench.turn(driver), Action::Forget);
    if host == Host::Absent {
        for _ in 0..3 {
            driver.record(0, material(0));
            bench.now += 1_000_000;
            assert_eq!(driver.poll(ORIGIN + bench.now), Action::Wait);
            assert_eq!(driver.poll_delay(ORIGIN + bench.now), None);
            assert!(driver.outgoing().is_empty());
        }
        return;
    }
    bench.wait(driver, 499);
    assert_eq!(bench.heard, [Request::Failed(failure.into())]);
    assert_eq!(bench.frames.len(), 1);
    // The pause begins when the host has received it; a reading now would be one of before.
    driver.record(0, material(0));
    while bench.heard.len() < 2 {
        bench.turn(driver);
    }
    assert!(matches!(bench.heard[1], Request::Hello { .. }));
    assert_eq!(bench.frames[1].0, start + 500);
    assert_eq!(driver.scan().unwrap().pending().count(), SAMPLES);
}

/// A host that answers some requests wrongly causes the failure; after it answers rightly, the scan ends.
pub(crate) fn fails(host: Host, wrong: impl Fn(&Request) -> Option<Reply>, failure: Failure) {
    let mut driver = phong(Config::new(host));
    let healed = Cell::new(false);
    let mut bench = Bench::new(|request| {
        let wrong = wrong(request).filter(|_| !healed.get());
        Some(wrong.unwrap_or_else(|| answer(request)))
    });
    bench.run(&mut driver, is_failed);
    healed.set(true);
    check_aftermath(host, &mut bench, &mut driver, failure);
    bench.run(&mut driver, is_finished);
    let expected = whole::<Any>(*driver.scan().unwrap().recipe(), material);
    assert_eq!(bench.results(), (expected.bits().to_vec(), 1));
}

#[test]
fn a_refused_request_ends_the_scan_by_name() {
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
                fails(*host, refuse, Failure::Refused(refusal));
            }
        }
    }
}

#[test]
fn a_host_of_another_protocol_is_refused_by_name() {
    for protocol in [PROTOCOL - 1, PROTOCOL + 1, 0, u16::MAX] {
        let failure = Failure::Protocol {
            device: PROTOCOL,
            host: protocol,
        };
        for host in HOSTS {
            let welcome = |r: &Request| {
                matches!(r, Request::Hello { .. }).then_some(Reply::Welcome { protocol })
            };
            fails(host, welcome, failure);
        }
    }
}

/// The report of a failure may be lost or refused as well: the host is greeted after a pause.
#[test]
fn a_failure_is_reported_for_2_s_only() {
    for refuses in [false, true] {
        let mut driver = phong(Config::new(Host::Measures));
        let mut bench = Bench::new(|request| match request {
            Request::Measure { .. } => Some(Reply::Refused(Refusal::Directions)),
            Request::Failed(_) if refuses => Some(Reply::Refused(Refusal::NoScan)),
            Request::Failed(_) => None,
            _ => Some(answer(request)),
        });
        bench.run(&mut driver, is_failed);
        bench.frames.clear();
        bench.heard.clear();
        while bench.heard.len() < 2 {
            bench.turn(&mut driver);
        }
        assert_eq!(bench.now, if refuses { 500 } else { 2_500 });
        let [Request::Failed(_), Request::Hello { .. }] = bench.heard[..] else {
            panic!("{:?}", bench.heard)
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
fn if_the_host_refuses_a_kept_reading_all_are_taken_again() {
    for model in MODELS {
        let recipe = recipe_of(model);
        let mut scan = scan_by::<Any>(recipe);
        // The second of them is another material's.
        record(&mut scan, 2..6, |index| {
            material(if index == 3 { 7 } else { index })
        });
        let mut driver = Driver::new(scan, Config::new(Host::Measures));
        let mut bench = Bench::willing();
        bench.run(&mut driver, is_finished);
        assert_eq!((bench.count(is_kept), bench.count(is_measure)), (2, 8));
        assert_eq!(bench.results().0, whole::<Any>(recipe, material).bits());
        let actions = bench.take_actions();
        assert_eq!(actions[0], Action::Forget);
        assert!(!actions[1..].contains(&Action::Forget));
    }
}

#[test]
fn a_failure_of_the_machine_is_reported() {
    for host in [Host::Measures, Host::Listens, Host::Absent] {
        let mut driver = phong(Config::new(host));
        let mut bench = Bench::willing();
        while driver.scan().unwrap().pending().count() > 4 {
            bench.turn(&mut driver);
        }
        driver.fail(Failure::Machine);
        // A late reading does not hide it.
        driver.record(7, material(7));
        assert!(is_failed(&bench.turn(&mut driver)));
        check_aftermath(host, &mut bench, &mut driver, Failure::Machine);
        if host == Host::Absent {
            driver.restart();
            assert_eq!(bench.turn(&mut driver), Action::Forget);
            assert_eq!(driver.scan().unwrap().pending().count(), SAMPLES);
        }
        bench.run(&mut driver, is_finished);
    }
}

#[test]
fn counts_are_reported_by_name() {
    let counts = |request: &Request| match request {
        Request::Measure { index, .. } => Some(Reply::Measured {
            index: *index,
            reading: Reading::monochrome(1_000.0 + f32::from(*index)),
        }),
        _ => None,
    };
    let failure = Failure::Fit(FitError::TooLarge { limit: 10 });
    fails(Host::Measures, counts, failure);
}

#[test]
fn a_fit_that_diverges_is_reported_by_name() {
    let mut numbers = neural();
    numbers.step_sizes.fill(1e30);
    let recipe = parsed(numbers.write().unwrap());
    for host in [Host::Measures, Host::Listens, Host::Absent] {
        let mut driver = driver_by::<Any>(recipe, Config::new(host));
        let mut bench = Bench::willing();
        bench.run(&mut driver, is_failed);
        check_aftermath(host, &mut bench, &mut driver, Failure::Diverged);
    }
}

/// A device without a scan says why, again and again but not in haste.
#[test]
fn a_device_without_a_valid_recipe_reports_it() {
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
            let mut bench = Bench::willing();
            bench.wait(&mut driver, 2_000);
            assert_eq!(bench.heard.len(), 8, "{:?}", bench.heard);
            for pair in bench.heard.chunks(2) {
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
            driver.record(0, material(0));
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
