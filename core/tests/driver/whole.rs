//! Whole scans, with a host that measures, that listens, and with none.

use glimpse_core::driver::{Action, Config, Driver, Host};
use glimpse_core::fit::Fitter;
use glimpse_core::link::{PROTOCOL, Request, VALUES_PER_FRAME};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{Memory, Residual, Scan};
use proptest::prelude::*;

use super::bench::{Bench, answer, is_finished};
use super::scanning::{Outcome, SAMPLES, every_fitter, material, whole};

/// What a scan alone ends in.
fn expected<K: Fitter>(recipe: Recipe<'_>) -> (Vec<u32>, Residual) {
    match whole::<K>(recipe, material) {
        Outcome::Fitted(bits, residual) => (bits, residual),
        other => panic!("{other:?}"),
    }
}

/// The bits of the values of a driver's fitted material.
fn fitted<K: Fitter>(driver: &Driver<'_, '_, K, SAMPLES>) -> (Vec<u32>, Residual) {
    let fitted = driver.scan().unwrap().fitted().unwrap();
    let residual = fitted.residual();
    let numbers = fitted.values().chain([residual.mean, residual.worst]);
    (numbers.map(f32::to_bits).collect(), residual)
}

/// Each request in turn, each heard once; `measures` if the host is asked to.
fn check_requests(recipe: &Recipe<'_>, heard: &[Request], slice: u32, measures: bool) {
    let mut heard = heard.iter();
    let (samples, total) = (recipe.samples() as u16, recipe.descent().map_or(8, |_| 160));
    let hello = Request::Hello {
        protocol: PROTOCOL,
        model: recipe.model(),
        samples,
        recipe: recipe.checksum(),
    };
    assert_eq!(heard.next(), Some(&hello));
    for index in (0..samples).filter(|_| measures) {
        let next = heard.next();
        assert!(matches!(next, Some(Request::Measure { index: found, .. }) if *found == index));
    }
    for slices in 1..=u32::div_ceil(total, slice) {
        let done = (slices * slice).min(total);
        let next = heard.next();
        assert!(
            matches!(next, Some(Request::Progress(found)) if (found.done, found.total) == (done, total)),
            "{next:?}"
        );
    }
    let values = recipe.model().parameters().unwrap_or(15);
    for from in (0..values).step_by(VALUES_PER_FRAME) {
        let Some(Request::Values {
            offset,
            total,
            values: found,
        }) = heard.next()
        else {
            panic!("values are told")
        };
        assert_eq!((usize::from(*offset), usize::from(*total)), (from, values));
        assert_eq!(found.len(), (values - from).min(VALUES_PER_FRAME));
    }
    assert!(matches!(heard.next(), Some(Request::Finished(_))));
    assert_eq!(heard.next(), None);
}

/// Save after each reading, the end, and then Forget.
fn check_actions(actions: &[Action], order: &[u16], residual: Residual) {
    let saves = order.iter().map(|index| Action::Save {
        index: *index,
        reading: material(*index),
    });
    let expected: Vec<_> = saves.chain([Action::Finished(residual)]).collect();
    assert_eq!(actions, expected);
}

const IN_ORDER: [u16; 8] = [0, 1, 2, 3, 4, 5, 6, 7];

/// The next scan begins by itself, and is like the first.
fn measured_by_a_host<K: Fitter>(recipe: Recipe<'_>, slice: u32) {
    let (bits, residual) = expected::<K>(recipe);
    let mut memory = Memory::<K, SAMPLES>::new();
    let scan = Scan::new(recipe, &mut memory).unwrap();
    let config = Config {
        slice,
        ..Config::new(Host::Measures)
    };
    let mut driver = Driver::new(Ok(scan), config);
    let mut bench = Bench::willing();
    for scans in 0..3 {
        if scans > 0 {
            bench.run(&mut driver, |action| *action == Action::Forget);
            bench.take_actions();
            assert_eq!(driver.scan().unwrap().pending().count(), SAMPLES);
            bench.heard.clear();
        }
        bench.run(&mut driver, is_finished);
        assert_eq!(fitted(&driver), (bits.clone(), residual));
        assert_eq!(bench.told(), (bits.clone(), 1));
        check_requests(&recipe, &bench.heard, slice.max(1), true);
        check_actions(&bench.take_actions(), &IN_ORDER, residual);
    }
    // Nobody was waited for.
    assert_eq!(bench.now, 0);
}

#[test]
fn a_host_that_measures_gets_the_bits_of_a_scan_alone() {
    every_fitter!(measured_by_a_host, 8);
    every_fitter!(measured_by_a_host, 0);
    every_fitter!(measured_by_a_host, 1_000);
}

fn with_own_arms<K: Fitter>(recipe: Recipe<'_>, host: Host, order: &[u16]) {
    let (bits, residual) = expected::<K>(recipe);
    let mut memory = Memory::<K, SAMPLES>::new();
    let scan = Scan::new(recipe, &mut memory).unwrap();
    let config = Config::new(host);
    let mut driver = Driver::new(Ok(scan), config);
    let mut bench = Bench::willing();
    for scans in 0..2 {
        for index in order {
            // Any of those pending will do.
            let action = loop {
                let action = driver.poll(1);
                let bytes = driver.outgoing().to_vec();
                driver.sent(bytes.len());
                for byte in bench.reply_to(&bytes) {
                    driver.receive(byte);
                }
                match action {
                    Action::Measure { .. } => break action,
                    Action::Wait { milliseconds } => assert_ne!(milliseconds, u32::MAX),
                    Action::Continue => {}
                    Action::Save { .. } | Action::Forget => bench.actions.push((0, action)),
                    other => panic!("{other:?}"),
                }
            };
            // The same is said until a reading is recorded.
            assert_eq!(driver.poll(1_000), action);
            driver.record(*index, material(*index));
        }
        bench.sensor = Box::new(|index| panic!("{index} was read"));
        bench.run(&mut driver, is_finished);
        assert_eq!(fitted(&driver), (bits.clone(), residual));
        let mut actions = bench.take_actions();
        if scans > 0 {
            assert_eq!(actions.remove(0), Action::Forget);
        }
        check_actions(&actions, order, residual);
        if host == Host::Listens {
            assert_eq!(bench.told(), (bits.clone(), 1));
            check_requests(&recipe, &bench.heard, 8, false);
        } else {
            assert!(bench.heard.is_empty() && bench.frames.is_empty());
        }

        // Then it rests, until it is told to begin anew.
        for _ in 0..2 {
            let forgets = (0..5).map(|_| driver.poll(1_000)).collect::<Vec<_>>();
            let count = forgets
                .iter()
                .filter(|action| **action == Action::Forget)
                .count();
            assert!(count <= 1, "{forgets:?}");
            let rests = Action::Wait {
                milliseconds: u32::MAX,
            };
            assert_eq!(forgets.last(), Some(&rests));
        }
        assert!(driver.outgoing().is_empty());
        driver.restart();
        bench.heard.clear();
    }
}

#[test]
fn a_device_with_arms_of_its_own_ends_in_the_same_bits() {
    for host in [Host::Absent, Host::Listens] {
        every_fitter!(with_own_arms, host, &IN_ORDER);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]
    #[test]
    fn its_own_readings_come_in_any_order(order in Just(IN_ORDER.to_vec()).prop_shuffle()) {
        for host in [Host::Absent, Host::Listens] {
            every_fitter!(with_own_arms, host, &order);
        }
    }
}

/// Two calls without time in between do nothing twice.
#[test]
fn a_call_without_time_sends_nothing_again() {
    fn check<K: Fitter>(recipe: Recipe<'_>) {
        let mut memory = Memory::<K, SAMPLES>::new();
        let scan = Scan::new(recipe, &mut memory).unwrap();
        let mut driver = Driver::new(Ok(scan), Config::new(Host::Measures));
        let mut bench = Bench::willing();
        loop {
            let action = bench.turn(&mut driver);
            if let Action::Wait { .. } = action
                && bench.elapsed > 0
            {
                panic!("a reply was there");
            }
            if is_finished(&action) {
                break;
            }
        }
        // Deaf from now on.
        bench.deaf = true;
        bench.run(&mut driver, |action| matches!(action, Action::Wait { .. }));
        let frames = bench.frames.len();
        for _ in 0..100 {
            let milliseconds = 100;
            assert_eq!(driver.poll(0), Action::Wait { milliseconds });
            assert!(driver.outgoing().is_empty());
        }
        assert_eq!(bench.frames.len(), frames);
    }
    every_fitter!(check);
}

/// A reading that is taken anew in the middle of a fit gives it up, and the fit begins again.
#[test]
fn a_reading_in_the_middle_of_the_fit_begins_it_again() {
    fn check<K: Fitter>(recipe: Recipe<'_>, host: Host) {
        let (bits, residual) = expected::<K>(recipe);
        let mut memory = Memory::<K, SAMPLES>::new();
        let scan = Scan::new(recipe, &mut memory).unwrap();
        let config = Config {
            slice: 2,
            ..Config::new(host)
        };
        let mut driver = Driver::new(Ok(scan), config);
        let mut bench = Bench::new(|request| Some(answer(request)));
        bench.sensor = Box::new(|index| {
            if index == 6 {
                material(0)
            } else {
                material(index)
            }
        });
        while driver.scan().unwrap().next_pending().is_some() {
            bench.turn(&mut driver);
        }
        for _ in 0..6 {
            bench.turn(&mut driver);
        }
        driver.record(6, material(6));
        bench.run(&mut driver, is_finished);
        assert_eq!(fitted(&driver), (bits, residual));
    }
    every_fitter!(check, Host::Absent);
    every_fitter!(check, Host::Listens);
}
