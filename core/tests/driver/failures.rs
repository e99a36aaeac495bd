//! Whatever goes wrong is said by name, to the firmware and to the host, and not tried again in haste.

use glimpse_core::driver::{Action, Config, Driver, Host};
use glimpse_core::fit::Fitter;
use glimpse_core::link::{Failure, PROTOCOL, Refusal, Reply, Request};
use glimpse_core::model::{Neural, Phong};
use glimpse_core::recipe::{Recipe, RecipeError};
use glimpse_core::scan::{FitError, Memory, Reading, Scan, ScanError};

use super::bench::{Bench, answer, is_failed, is_finished};
use super::scanning::{SAMPLES, every_fitter, material, whole};
use super::silence::with_phong;

/// After the failure: kept readings are forgotten, the host is told, half a second is rest, and then
/// it is greeted again, all to be measured.
pub(crate) fn check_aftermath<K: Fitter>(
    bench: &mut Bench<'_>,
    driver: &mut Driver<'_, '_, K, SAMPLES>,
    failure: Failure,
) {
    assert_eq!(bench.actions.last().unwrap().1, Action::Failed(failure));
    let start = bench.now;
    bench.heard.clear();
    bench.frames.clear();
    assert_eq!(bench.turn(driver), Action::Forget);
    bench.wait(driver, 499);
    assert_eq!(bench.heard, [Request::Failed(failure)]);
    assert_eq!(bench.frames.len(), 1);
    // Its pause begins when the host has heard of it; a reading now would be one of before.
    driver.record(0, material(0));
    while bench.heard.len() < 2 {
        bench.turn(driver);
    }
    assert!(matches!(bench.heard[1], Request::Hello { .. }));
    assert_eq!(bench.frames[1].0, start + 500);
    if let Ok(scan) = driver.scan() {
        assert_eq!(scan.pending().count(), SAMPLES);
    }
}

/// A failure of a host that answers one request so, at first.
fn fails(host: Host, wrong: impl Fn(&Request) -> Option<Reply>, failure: Failure) {
    with_phong(Config::new(host), |driver| {
        let healed = std::cell::Cell::new(false);
        let mut bench = Bench::new(|request| {
            let wrong = wrong(request).filter(|_| !healed.get());
            Some(wrong.unwrap_or_else(|| answer(request)))
        });
        bench.run(driver, is_failed);
        healed.set(true);
        check_aftermath(&mut bench, driver, failure);
        bench.run(driver, is_finished);
        let expected = whole::<Phong>(*driver.scan().unwrap().recipe(), material);
        assert_eq!(bench.told(), (expected.bits().to_vec(), 1));
    });
}

#[test]
fn a_refused_request_ends_the_scan_by_name() {
    for refusal in [
        Refusal::NoScan,
        Refusal::Directions,
        Refusal::Values,
        Refusal::Model,
    ] {
        let failure = Failure::Refused(refusal);
        let refuse = |of: fn(&Request) -> bool| {
            move |request: &Request| of(request).then_some(Reply::Refused(refusal))
        };
        fails(
            Host::Measures,
            refuse(|r| matches!(r, Request::Hello { .. })),
            failure,
        );
        fails(
            Host::Measures,
            refuse(|r| matches!(r, Request::Measure { index: 3, .. })),
            failure,
        );
        for host in [Host::Measures, Host::Listens] {
            fails(host, refuse(|r| matches!(r, Request::Progress(_))), failure);
            fails(
                host,
                refuse(|r| matches!(r, Request::Values { .. })),
                failure,
            );
            fails(host, refuse(|r| matches!(r, Request::Finished(_))), failure);
        }
    }
}

#[test]
fn a_host_of_another_protocol_is_refused_by_name() {
    for host in [PROTOCOL - 1, PROTOCOL + 1, 0, u16::MAX] {
        let failure = Failure::Protocol {
            device: PROTOCOL,
            host,
        };
        let welcome = move |request: &Request| {
            matches!(request, Request::Hello { .. }).then_some(Reply::Welcome { protocol: host })
        };
        fails(Host::Measures, welcome, failure);
        fails(Host::Listens, welcome, failure);
    }
}

/// The host cannot be told a second time either: it is greeted, after a pause.
#[test]
fn a_failure_that_nobody_hears_of_is_told_for_2_s_only() {
    for refuses in [false, true] {
        with_phong(Config::new(Host::Measures), |driver| {
            let mut bench = Bench::new(|request| match request {
                Request::Measure { .. } => Some(Reply::Refused(Refusal::Directions)),
                Request::Failed(_) if refuses => Some(Reply::Refused(Refusal::NoScan)),
                Request::Failed(_) => None,
                _ => Some(answer(request)),
            });
            bench.run(driver, is_failed);
            bench.frames.clear();
            bench.heard.clear();
            while bench.heard.len() < 2 {
                bench.turn(driver);
            }
            assert_eq!(bench.now, if refuses { 500 } else { 2_500 });
            assert!(matches!(
                bench.heard[..],
                [Request::Failed(_), Request::Hello { .. }]
            ));
            assert_eq!(
                bench
                    .frames
                    .iter()
                    .take_while(|f| f.1 == bench.frames[0].1)
                    .count(),
                if refuses { 1 } else { 20 }
            );
            // One failure for each attempt.
            let failed = bench.take_actions();
            assert_eq!(failed.iter().filter(|action| is_failed(action)).count(), 1);
        });
    }
}

/// All readings are taken anew, and what was kept is forgotten.
#[test]
fn refused_kept_readings_are_all_taken_anew() {
    fn check<K: Fitter>(recipe: Recipe<'_>) {
        let mut memory = Memory::<K, SAMPLES>::new();
        let mut scan = Scan::new(recipe, &mut memory).unwrap();
        // The second of them is another material's.
        for index in 2..6 {
            let reading = if index == 3 {
                material(7)
            } else {
                material(index)
            };
            scan.record(index, reading).unwrap();
        }
        let mut driver = Driver::new(Ok(scan), Config::new(Host::Measures));
        let mut bench = Bench::willing();
        bench.run(&mut driver, is_finished);
        let kept = |r: &&Request| matches!(r, Request::Kept { .. });
        let measured = |r: &&Request| matches!(r, Request::Measure { .. });
        assert_eq!(bench.heard.iter().filter(kept).count(), 2);
        assert_eq!(bench.heard.iter().filter(measured).count(), 8);
        assert_eq!(bench.told().0, whole::<K>(recipe, material).bits());
        let actions = bench.take_actions();
        assert_eq!(actions[0], Action::Forget);
        assert_eq!(actions.iter().filter(|a| **a == Action::Forget).count(), 1);
    }
    every_fitter!(check);
}

/// A device alone has nobody to tell: it forgets, and rests until it is told to begin anew.
pub(crate) fn check_rest<K: Fitter>(driver: &mut Driver<'_, '_, K, SAMPLES>) {
    assert_eq!(driver.poll(0), Action::Forget);
    for _ in 0..3 {
        driver.record(0, material(0));
        let milliseconds = u32::MAX;
        assert_eq!(driver.poll(1_000_000), Action::Wait { milliseconds });
        assert!(driver.outgoing().is_empty());
    }
}

#[test]
fn a_machine_that_fails_is_told_of() {
    for host in [Host::Measures, Host::Listens] {
        with_phong(Config::new(host), |driver| {
            let mut bench = Bench::willing();
            while driver.scan().unwrap().pending().count() > 4 {
                bench.turn(driver);
            }
            driver.fail(Failure::Machine);
            assert!(is_failed(&bench.turn(driver)));
            check_aftermath(&mut bench, driver, Failure::Machine);
            bench.run(driver, is_finished);
        });
    }
    with_phong(Config::new(Host::Absent), |driver| {
        let mut bench = Bench::willing();
        while driver.scan().unwrap().pending().count() > 4 {
            bench.turn(driver);
        }
        driver.fail(Failure::Machine);
        // What comes too late does not hide it.
        driver.record(7, material(7));
        assert_eq!(driver.poll(0), Action::Failed(Failure::Machine));
        check_rest(driver);
        driver.restart();
        assert_eq!(bench.turn(driver), Action::Forget);
        assert_eq!(driver.scan().unwrap().pending().count(), SAMPLES);
        bench.run(driver, is_finished);
    });
}

/// Readings that no fit can take, and a fit that runs away.
#[test]
fn counts_and_divergence_are_told_by_name() {
    let counts = |request: &Request| match request {
        Request::Measure { index, .. } => Some(Reply::Measured {
            index: *index,
            reading: Reading::monochrome(1_000.0 + f32::from(*index)),
        }),
        _ => None,
    };
    let failure = Failure::Fit(FitError::Implausible { limit: 10 });
    fails(Host::Measures, counts, failure);

    let mut numbers = super::common::neural();
    numbers.step_sizes.fill(1e30);
    let bytes = super::common::write(&numbers).unwrap();
    for host in [Host::Measures, Host::Listens, Host::Absent] {
        let mut memory = Memory::<Neural, SAMPLES>::new();
        let scan = Scan::new(Recipe::parse(&bytes).unwrap(), &mut memory).unwrap();
        let mut driver = Driver::new(Ok(scan), Config::new(host));
        let mut bench = Bench::willing();
        bench.run(&mut driver, is_failed);
        match host {
            Host::Absent => {
                let last = bench.take_actions().pop();
                assert_eq!(last, Some(Action::Failed(Failure::Diverged)));
                check_rest(&mut driver);
            }
            _ => check_aftermath(&mut bench, &mut driver, Failure::Diverged),
        }
    }
}

/// A device without a scan says why, again and again but not in haste.
#[test]
fn a_recipe_that_is_none_is_told_of() {
    let capacity = ScanError::Capacity {
        capacity: 1,
        samples: 8,
    };
    for failure in [
        Failure::Recipe(RecipeError::Checksum),
        Failure::Scan(capacity),
    ] {
        for host in [Host::Measures, Host::Listens] {
            let mut driver = Driver::<Phong, SAMPLES>::new(Err(failure), Config::new(host));
            let mut bench = Bench::willing();
            bench.wait(&mut driver, 2_000);
            assert_eq!(bench.heard.len(), 8, "{:?}", bench.heard);
            for pair in bench.heard.chunks(2) {
                let [hello, failed] = pair else { panic!() };
                assert!(matches!(
                    hello,
                    Request::Hello {
                        samples: 0,
                        recipe: 0,
                        ..
                    }
                ));
                assert_eq!(*failed, Request::Failed(failure));
            }
            assert_eq!(driver.scan().err(), Some(failure));
            driver.record(0, material(0));
            driver.restart();
            bench.wait(&mut driver, 1_000);
            assert!(!bench.actions.iter().any(|(_, action)| is_finished(action)));
        }
        let mut driver = Driver::<Phong, SAMPLES>::new(Err(failure), Config::new(Host::Absent));
        for _ in 0..2 {
            let said: Vec<_> = (0..6).map(|_| driver.poll(10)).collect();
            let failed = said
                .iter()
                .filter(|action| **action == Action::Failed(failure));
            assert_eq!(failed.count(), 1, "{said:?}");
            let milliseconds = u32::MAX;
            assert_eq!(said.last(), Some(&Action::Wait { milliseconds }));
            driver.restart();
        }
    }
}
