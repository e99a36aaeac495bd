//! Full scans with a host that measures, with a host that listens, and without a host.

use glimpse_core::driver::{Action, Config, Driver, Host};
use glimpse_core::fit::Fitter;
use glimpse_core::link::{PROTOCOL, Request, VALUES_PER_FRAME};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Residual;
use proptest::prelude::*;

use super::bench::{Bench, is_finished, new_driver};
use crate::scanning::{
    Any, MODELS, Outcome, SAMPLES, for_every_fitter, full_scan, recipe_for, synthetic_reading,
};

const IN_ORDER: [u16; 8] = [0, 1, 2, 3, 4, 5, 6, 7];

/// The fitted material of a driver.
fn fitted<K: Fitter>(driver: &Driver<'_, K>) -> Outcome {
    let fitted = driver.scan().unwrap().fitted().unwrap();
    let residual = fitted.residual();
    let numbers = fitted.values().chain([residual.mean, residual.worst]);
    Outcome::Fitted(numbers.map(f32::to_bits).collect(), residual)
}

/// Checks that the host received each request once, in order. `measures` is true if the host measures.
fn check_requests(recipe: &Recipe<'_>, requests: &[Request], slice: u32, measures: bool) {
    let mut requests = requests.iter();
    let mut next = || requests.next().expect("a request is missing");
    let (samples, total) = (recipe.samples() as u16, recipe.descent().map_or(8, |_| 160));
    let hello = Request::Hello {
        protocol: PROTOCOL,
        model: recipe.model(),
        samples,
        recipe: recipe.checksum(),
    };
    assert_eq!(*next(), hello);
    for expected in (0..samples).filter(|_| measures) {
        assert!(matches!(next(), Request::Measure { index, .. } if *index == expected));
    }
    for slices in 1..=u32::div_ceil(total, slice) {
        let Request::Progress(actual) = next() else {
            panic!("a progress request is missing")
        };
        let done = (slices * slice).min(total);
        assert_eq!((actual.done, actual.total), (done, total));
    }
    let count = recipe.model().parameters().unwrap_or(15);
    for from in (0..count).step_by(VALUES_PER_FRAME) {
        let Request::Values {
            offset,
            total,
            values,
        } = next()
        else {
            panic!("a request with values is missing")
        };
        assert_eq!((usize::from(*offset), usize::from(*total)), (from, count));
        assert_eq!(
            values.as_slice().len(),
            (count - from).min(VALUES_PER_FRAME)
        );
    }
    assert!(matches!(next(), Request::Finished(_)));
    assert_eq!(requests.next(), None);
}

/// Checks that a `Save` follows each reading, and `Finished` the last one.
fn check_actions(actions: &[Action], order: &[u16], residual: Residual) {
    let saves = order.iter().map(|index| Action::Save {
        index: *index,
        reading: synthetic_reading(*index),
    });
    let expected: Vec<_> = saves.chain([Action::Finished(residual)]).collect();
    assert_eq!(actions, expected);
}

/// Runs three scans. Each begins automatically, and gives the same result.
fn check_host_measurement<K: Fitter + 'static>(recipe: Recipe<'static>, slice: u32) {
    let expected = full_scan::<K>(recipe, synthetic_reading);
    let mut config = Config::new(Host::Measures);
    config.steps_per_poll = slice;
    let mut driver = new_driver::<K>(recipe, config);
    let mut bench = Bench::cooperative();
    for scans in 0..3 {
        if scans > 0 {
            bench.run(&mut driver, |action| *action == Action::Forget);
            bench.take_actions();
            assert_eq!(driver.scan().unwrap().pending().count(), SAMPLES);
            bench.requests.clear();
        }
        bench.run(&mut driver, is_finished);
        assert_eq!(fitted(&driver), expected);
        assert_eq!(bench.results(), (expected.bits().to_vec(), 1));
        check_requests(&recipe, &bench.requests, slice.max(1), true);
        check_actions(&bench.take_actions(), &IN_ORDER, expected.residual());
    }
    // No time has passed.
    assert_eq!(bench.now, 0);
}

#[test]
fn host_measurement_matches_plain_scan() {
    for_every_fitter!(check_host_measurement, 8);
    for model in MODELS {
        for slice in [0, 1_000] {
            check_host_measurement::<Any>(recipe_for(model), slice);
        }
    }
}

fn check_own_arms<K: Fitter + 'static>(recipe: Recipe<'static>, host: Host, order: &[u16]) {
    let expected = full_scan::<K>(recipe, synthetic_reading);
    let mut driver = new_driver::<K>(recipe, Config::new(host));
    let mut bench = Bench::cooperative();
    for scans in 0..2 {
        for index in order {
            // Any pending sample may be read.
            let action = loop {
                bench.now += 1;
                let action = driver.poll(bench.now);
                let bytes = driver.outgoing().to_vec();
                driver.sent(bytes.len());
                for byte in bench.reply_to(&bytes) {
                    driver.receive(byte);
                }
                match action {
                    Action::Measure { .. } => break action,
                    Action::Wait => assert!(driver.poll_delay(bench.now).is_some()),
                    Action::Continue => {}
                    Action::Save { .. } | Action::Forget => bench.actions.push((0, action)),
                    other => panic!("{other:?}"),
                }
            };
            // The action stays the same until a reading is recorded.
            bench.now += 1_000;
            assert_eq!(driver.poll(bench.now), action);
            assert_eq!(driver.poll_delay(bench.now), None);
            driver.record(*index, synthetic_reading(*index));
        }
        bench.sensor = Box::new(|index| panic!("{index} was read"));
        bench.run(&mut driver, is_finished);
        assert_eq!(fitted(&driver), expected);
        let mut actions = bench.take_actions();
        if scans > 0 {
            assert_eq!(actions.remove(0), Action::Forget);
        }
        check_actions(&actions, order, expected.residual());
        if host == Host::Listens {
            assert_eq!(bench.results(), (expected.bits().to_vec(), 1));
            check_requests(&recipe, &bench.requests, 8, false);
        } else {
            assert!(bench.requests.is_empty() && bench.frames.is_empty());
        }

        // The driver then waits for a restart.
        for _ in 0..2 {
            bench.now += 1_000;
            let actions: Vec<_> = (0..5).map(|_| driver.poll(bench.now)).collect();
            let forgets = actions.iter().filter(|action| **action == Action::Forget);
            assert!(forgets.count() <= 1, "{actions:?}");
            assert_eq!(actions.last(), Some(&Action::Wait));
            assert_eq!(driver.poll_delay(bench.now), None);
        }
        assert!(driver.outgoing().is_empty());
        driver.restart();
        bench.requests.clear();
    }
}

#[test]
fn own_arms_match_plain_scan() {
    for host in [Host::Absent, Host::Listens] {
        for_every_fitter!(check_own_arms, host, &IN_ORDER);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]
    #[test]
    fn own_readings_in_any_order(order in Just(IN_ORDER.to_vec()).prop_shuffle()) {
        for host in [Host::Absent, Host::Listens] {
            for model in MODELS {
                check_own_arms::<Any>(recipe_for(model), host, &order);
            }
        }
    }
}

/// A second reading of a sample during a fit discards the fit, and a new fit begins.
#[test]
fn reading_during_fit_restarts_it() {
    for model in MODELS {
        for host in [Host::Absent, Host::Listens] {
            let recipe = recipe_for(model);
            let mut config = Config::new(host);
            config.steps_per_poll = 2;
            let mut driver = new_driver::<Any>(recipe, config);
            let mut bench = Bench::cooperative();
            bench.sensor = Box::new(|index| synthetic_reading(if index == 6 { 0 } else { index }));
            while driver.scan().unwrap().next_pending().is_some() {
                bench.step(&mut driver);
            }
            for _ in 0..6 {
                bench.step(&mut driver);
            }
            driver.record(6, synthetic_reading(6));
            bench.run(&mut driver, is_finished);
            assert_eq!(fitted(&driver), full_scan::<Any>(recipe, synthetic_reading));
        }
    }
}
