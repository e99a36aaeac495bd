//! A scan stops at the first reading after which the bound of the loss is at most the target. The result has the bits of
//! a separate fit of the same readings.

use std::cell::Cell;

use glimpse_core::driver::{Action, Config, Host};
use glimpse_core::fit::coefficient_net::MissingPolicy;
use glimpse_core::link::{Failure, Reply, Request};
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{FitError, Reading, Scan};

use super::bench::{
    AnyDriver, Bench, ORIGIN, default_reply, is_failed, is_finished, is_measure, is_saved,
    new_driver,
};
use super::missing::fitted_bits;
use crate::completion::contents::{CompletedContents, SAMPLES};
use crate::completion::partial::{all_small, with_partial};
use crate::scanning::{Any, Outcome, fit, new_scan, record, synthetic_reading};

const HOSTS: [Host; 3] = [Host::Measures, Host::Listens, Host::Absent];
const ALL: u16 = SAMPLES as u16;

fn config(host: Host, target: f32) -> Config {
    let mut config = Config::new(host);
    config.target_loss = Some(target);
    config
}

/// A fit of some readings: the bits of the values and of the residual, and the bound of the loss if the fit is
/// plausible. None if the fit fails.
fn separate_fit(
    recipe: Recipe<'static>,
    samples: impl IntoIterator<Item = u16>,
    reading: fn(u16) -> Reading,
) -> Option<(Vec<u32>, Option<f32>)> {
    let mut scan = new_scan::<Any>(recipe);
    record(&mut scan, samples, reading);
    match fit(&mut scan, &[u32::MAX]) {
        Outcome::Fitted(bits, residual) => {
            let bound = scan.fitted().unwrap().loss_bound();
            Some((bits, bound.filter(|_| residual.implausible.is_none())))
        }
        Outcome::TooLarge | Outcome::Diverged => None,
    }
}

/// The bound of the loss after each number of readings.
fn bounds(recipe: Recipe<'static>, reading: fn(u16) -> Reading) -> Vec<Option<f32>> {
    let bound = |count| separate_fit(recipe, 0..count, reading)?.1;
    (1..=ALL).map(bound).collect()
}

/// The number of readings of a scan that stops at a target.
fn expected_count(bounds: &[Option<f32>], target: f32) -> u16 {
    let is_reached = |bound: &Option<f32>| bound.is_some_and(|bound| bound <= target);
    let index = bounds.iter().position(is_reached);
    index.map_or(ALL, |index| index as u16 + 1)
}

/// Negative readings are clamped by the first fit.
fn reading_below_0(index: u16) -> Reading {
    match index {
        1 => Reading::new([-0.02, 0.3, 0.2]),
        _ => synthetic_reading(index),
    }
}

fn is_progress(request: &Request) -> bool {
    matches!(request, Request::Progress(_))
}

/// A host and a device with this sensor.
fn bench_with(reading: fn(u16) -> Reading) -> Bench<'static> {
    let mut bench = Bench::new(move |request| match request {
        Request::Measure { index, .. } => Some(Reply::Measured {
            index: *index,
            reading: reading(*index),
        }),
        Request::Saved { .. } => Some(Reply::Accepted),
        _ => Some(default_reply(request)),
    });
    bench.sensor = Box::new(reading);
    bench
}

/// The samples with a reading.
fn read_samples(driver: &AnyDriver) -> Vec<u16> {
    let scan = driver.scan().unwrap();
    let is_read = |index: &u16| scan.reading(*index).is_some();
    (0..ALL).filter(is_read).collect()
}

/// Checks that a driver has finished with the first `count` samples.
#[track_caller]
fn check_result(driver: &AnyDriver, count: u16, reading: fn(u16) -> Reading) {
    let recipe = *driver.scan().unwrap().recipe();
    assert_eq!(read_samples(driver), Vec::from_iter(0..count));
    let (bits, bound) = separate_fit(recipe, 0..count, reading).unwrap();
    assert_eq!(fitted_bits(driver), bits);
    let fitted = driver.scan().unwrap().fitted().unwrap();
    if fitted.residual().implausible.is_none() {
        assert_eq!(fitted.loss_bound(), bound);
    }
}

/// Runs two scans with a target, and checks the number of readings and the result.
fn check_scans(recipe: Recipe<'static>, config: Config, count: u16, reading: fn(u16) -> Reading) {
    let mut driver = new_driver::<Any>(recipe, config);
    for _ in 0..2 {
        let mut bench = bench_with(reading);
        let (_, finished) = bench.run(&mut driver, |action| {
            is_finished(action) || is_failed(action)
        });
        check_result(&driver, count, reading);
        let fitted = driver.scan().unwrap().fitted().unwrap();
        assert_eq!(finished, Action::Finished(fitted.residual()));
        let saves = |action: &Action| matches!(action, Action::Save { .. });
        let actions = bench.take_actions();
        assert_eq!(
            actions.iter().filter(|action| saves(action)).count(),
            usize::from(count)
        );
        if config.host == Host::Measures {
            assert_eq!(bench.count(is_measure), usize::from(count));
        }
        if config.host != Host::Absent {
            assert_eq!(bench.results(), (fitted_bits(&driver), 1));
            // An early stop needs no second fit.
            assert_eq!(bench.count(is_progress) > 0, count == ALL);
        }
        let forgets = driver.poll(ORIGIN);
        assert!(matches!(forgets, Action::Continue));
        assert_eq!(driver.poll(ORIGIN), Action::Forget);
        if config.host != Host::Measures {
            driver.restart();
        }
    }
}

#[test]
fn stops_at_first_bound_within_target() {
    let mut stops = [0; SAMPLES];
    for contents in all_small() {
        let recipe = contents.recipe();
        for reading in [synthetic_reading, reading_below_0] {
            let bounds = bounds(recipe, reading);
            let last = usize::from(ALL) - 1;
            for bound in bounds[..last].iter().flatten() {
                // The bound itself is within the target.
                for target in [*bound, bound.next_down(), 0.0, f32::MAX, f32::NAN] {
                    let count = expected_count(&bounds, target);
                    stops[usize::from(count) - 1] += 1;
                    for (host, steps) in HOSTS.into_iter().zip([8, 1_000, 3]) {
                        let mut config = config(host, target);
                        config.steps_per_poll = steps;
                        check_scans(recipe, config, count, reading);
                    }
                }
            }
        }
    }
    assert!(
        stops.into_iter().filter(|count| *count > 10).count() >= 4,
        "{stops:?}"
    );
}

/// Without the section, or with another section missing, the target has no effect on requests, actions and result.
#[test]
fn target_needs_sections() {
    let remove: [fn(&mut CompletedContents); 4] = [
        |contents| contents.partial = None,
        |contents| contents.uncertainty = None,
        |contents| contents.prediction = None,
        |contents| contents.missing = MissingPolicy::AllRequired as u8,
    ];
    for mut contents in all_small() {
        for remove in remove {
            let whole = contents.clone();
            remove(&mut contents);
            let recipe = contents.recipe();
            for host in HOSTS {
                let outcomes = [Config::new(host), config(host, f32::MAX)].map(|config| {
                    let mut driver = new_driver::<Any>(recipe, config);
                    let mut bench = bench_with(synthetic_reading);
                    bench.run(&mut driver, is_finished);
                    (bench.requests, bench.actions, fitted_bits(&driver))
                });
                assert_eq!(outcomes[0], outcomes[1]);
                assert_eq!(outcomes[0].1.len(), SAMPLES + 1, "a save for each sample");
            }
            contents = whole;
        }
    }
}

/// A driver without a target does not stop, whatever the recipe bounds.
#[test]
fn section_needs_target() {
    for contents in all_small() {
        for host in HOSTS {
            check_scans(contents.recipe(), Config::new(host), ALL, synthetic_reading);
        }
    }
}

/// Recipes with at least one plausible fit before the last reading, a target that is reached then, and the number of
/// readings.
fn stopping_cases() -> Vec<(CompletedContents, f32, u16)> {
    let mut cases = Vec::new();
    for contents in all_small() {
        let bounds = bounds(contents.recipe(), synthetic_reading);
        for target in bounds.iter().flatten() {
            let count = expected_count(&bounds, *target);
            if (2..ALL).contains(&count) {
                cases.push((contents.clone(), *target, count));
            }
        }
    }
    assert!(cases.len() > 5);
    cases
}

/// Readings from before a reset suffice, or the scan continues until they do.
#[test]
fn restored_readings_count() {
    for (contents, target, count) in stopping_cases() {
        for host in HOSTS {
            for restored in 0..=count {
                let mut scan: Scan<'static, Any> = new_scan(contents.recipe());
                record(&mut scan, 0..restored, synthetic_reading);
                let mut driver = AnyDriver::new(scan, config(host, target));
                let mut bench = bench_with(synthetic_reading);
                bench.run(&mut driver, is_finished);
                check_result(&driver, count, synthetic_reading);
                let saved = bench.actions.len() - 1;
                assert_eq!(saved, usize::from(count - restored));
                if host == Host::Measures {
                    assert_eq!(bench.count(is_saved), usize::from(restored));
                }
            }
        }
    }
}

/// Samples out of reach or unreadable are skipped, and do not count.
#[test]
fn skipped_samples_do_not_count() {
    for (contents, _, _) in stopping_cases() {
        let recipe = contents.recipe();
        for skipped in [0, 1] {
            let samples: Vec<u16> = (0..ALL).filter(|index| *index != skipped).collect();
            let bound = |count: usize| {
                let samples = samples[..count].iter().copied();
                separate_fit(recipe, samples, synthetic_reading)?.1
            };
            let Some((count, target)) = (1..4).find_map(|count| Some((count, bound(count)?)))
            else {
                continue;
            };
            let mut driver = new_driver::<Any>(recipe, config(Host::Measures, target));
            let mut bench = Bench::new(|request| match request {
                Request::Measure { index, .. } if *index == skipped => {
                    Some(Reply::Skip { index: skipped })
                }
                _ => Some(default_reply(request)),
            });
            bench.run(&mut driver, is_finished);
            assert_eq!(read_samples(&driver), samples[..count]);
        }
    }
}

/// A recipe whose fit diverges until sample `needed` is read.
fn diverging_until(contents: &CompletedContents, needed: usize) -> Recipe<'static> {
    let mut contents = contents.clone();
    let rows = contents.bias.len();
    contents.reading_scales[0] = f32::MAX;
    for (index, weight) in contents.readings.iter_mut().enumerate() {
        if index % rows == 0 {
            let is_missing_weight = index / rows == 3 * needed + 2;
            *weight = if is_missing_weight { 127 } else { 0 };
        }
    }
    contents.recipe()
}

#[test]
fn diverged_fit_does_not_end_scan() {
    let mut stops = 0;
    for contents in all_small() {
        for needed in [1, 4, SAMPLES - 1] {
            let recipe = diverging_until(&contents, needed);
            let bounds = bounds(recipe, synthetic_reading);
            assert!(bounds[..needed].iter().all(Option::is_none));
            for count in 1..=needed as u16 {
                assert_eq!(separate_fit(recipe, 0..count, synthetic_reading), None);
            }
            let count = expected_count(&bounds, f32::MAX);
            assert!(usize::from(count) > needed);
            stops += u32::from(count < ALL);
            for host in HOSTS {
                check_scans(recipe, config(host, f32::MAX), count, synthetic_reading);
            }
        }
    }
    assert!(stops > 5, "{stops}");
}

/// Sample 3 is saturated and never counts, so that the last fit diverges too.
#[test]
fn diverged_last_fit_fails() {
    for contents in all_small() {
        let recipe = diverging_until(&contents, 3);
        for host in HOSTS {
            let mut driver = new_driver::<Any>(recipe, config(host, f32::MAX));
            let mut bench = bench_with(synthetic_reading);
            let (_, failed) = bench.run(&mut driver, is_failed);
            assert_eq!(failed, Action::Failed(Failure::Diverged));
            assert_eq!(bench.actions.len(), SAMPLES + 1, "a save for each sample");
        }
    }
}

/// The first four readings are equal, as those of a stuck sensor.
fn stuck_reading(index: u16) -> Reading {
    match index {
        0..4 => Reading::new([0.2, 0.3, 0.1]),
        _ => synthetic_reading(index),
    }
}

#[test]
fn implausible_fit_does_not_end_scan() {
    let mut contents = with_partial(CompletedContents::small(
        ModelKind::Linear,
        MissingPolicy::Scaled,
    ));
    let part = contents.partial.as_mut().unwrap();
    part.bound = vec![1e9, 1e9, 1e9, 1e-6, 1e-3, 1e-3];
    let recipe = contents.recipe();
    let bounds = bounds(recipe, stuck_reading);
    assert_eq!(bounds[3], None);
    let target = bounds[4].unwrap();
    assert!(bounds[..3].iter().flatten().all(|bound| *bound > target));
    for host in HOSTS {
        check_scans(recipe, config(host, target), 5, stuck_reading);
    }
}

/// The readings are too large for any material until the last one.
#[test]
fn rejected_readings_do_not_end_scan() {
    fn reading(index: u16) -> Reading {
        match index {
            1..5 => Reading::monochrome(20.0 + f32::from(index)),
            _ => synthetic_reading(index),
        }
    }
    for contents in all_small() {
        let recipe = contents.recipe();
        let target = 1e-30; // no bound is as small
        assert_eq!(separate_fit(recipe, 0..5, reading), None);
        for host in HOSTS {
            check_scans(recipe, config(host, target), ALL, reading);
        }
        // The last fit reports the error, as without a target.
        let failures = [None, Some(target)].map(|target| {
            let mut config = Config::new(Host::Absent);
            config.target_loss = target;
            let mut driver = new_driver::<Any>(recipe, config);
            let mut bench = bench_with(|index| Reading::monochrome(20.0 + f32::from(index)));
            bench.run(&mut driver, is_failed).1
        });
        assert!(matches!(
            failures[0],
            Action::Failed(Failure::Fit(FitError::TooLarge { .. }))
        ));
        assert_eq!(failures[0], failures[1]);
    }
}

/// A reading, a skip, an early finish, a failure or a restart during a fit while samples are pending.
#[test]
fn fit_may_be_interrupted() {
    for (contents, target, count) in stopping_cases() {
        let recipe = contents.recipe();
        for host in [Host::Listens, Host::Absent] {
            let mut config = config(host, target);
            config.steps_per_poll = 1;
            // Returns a driver in the fit of the first reading.
            let begun = |bench: &mut Bench<'_>| {
                let mut driver = new_driver::<Any>(recipe, config);
                bench.run(&mut driver, |action| matches!(action, Action::Save { .. }));
                for _ in 0..4 {
                    assert_eq!(bench.step(&mut driver), Action::Continue);
                }
                driver
            };
            let mut bench = bench_with(synthetic_reading);
            let mut driver = begun(&mut bench);
            driver.record(1, synthetic_reading(1));
            bench.run(&mut driver, is_finished);
            check_result(&driver, count, synthetic_reading);

            let mut bench = bench_with(synthetic_reading);
            let mut driver = begun(&mut bench);
            driver.finish_early().unwrap();
            bench.run(&mut driver, is_finished);
            check_result(&driver, 1, synthetic_reading);

            let mut bench = bench_with(synthetic_reading);
            let mut driver = begun(&mut bench);
            for index in 1..ALL {
                driver.skip(index).unwrap();
            }
            bench.run(&mut driver, is_finished);
            check_result(&driver, 1, synthetic_reading);

            let mut bench = bench_with(synthetic_reading);
            let mut driver = begun(&mut bench);
            driver.fail(Failure::Machine);
            bench.run(&mut driver, is_failed);
            driver.restart();
            bench.run(&mut driver, is_finished);
            check_result(&driver, count, synthetic_reading);
        }
    }
}

/// After a timeout, the host confirms the readings. Those that a fit has clamped are read again.
#[test]
fn scan_continues_after_timeout() {
    for (contents, _, _) in stopping_cases() {
        let recipe = contents.recipe();
        let bounds = bounds(recipe, reading_below_0);
        let Some(target) = bounds[2] else { continue };
        let count = expected_count(&bounds, target);
        let is_silent = Cell::new(true);
        let mut bench = Bench::new(|request| match request {
            Request::Measure { index, .. } if *index + 1 == count && is_silent.get() => None,
            Request::Measure { index, .. } => Some(Reply::Measured {
                index: *index,
                reading: reading_below_0(*index),
            }),
            Request::Saved { index, reading } => {
                assert_eq!(*reading, reading_below_0(*index));
                Some(Reply::Accepted)
            }
            _ => Some(default_reply(request)),
        });
        let mut driver = new_driver::<Any>(recipe, config(Host::Measures, target));
        let (_, failed) = bench.run(&mut driver, is_failed);
        assert_eq!(failed, Action::Failed(Failure::NoReply));
        is_silent.set(false);
        bench.run(&mut driver, is_finished);
        let bits = separate_fit(recipe, read_samples(&driver), reading_below_0);
        assert_eq!(fitted_bits(&driver), bits.unwrap().0);
    }
}

/// A reading of a finished scan is fitted too, before the host has all values.
#[test]
fn reading_after_stop_is_fitted() {
    for (contents, target, count) in stopping_cases() {
        let recipe = contents.recipe();
        let mut driver = new_driver::<Any>(recipe, config(Host::Listens, target));
        let mut bench = bench_with(synthetic_reading);
        while bench.count(|request| matches!(request, Request::Values { .. })) == 0 {
            bench.step(&mut driver);
        }
        driver.record(count, synthetic_reading(count));
        bench.run(&mut driver, is_finished);
        check_result(&driver, count + 1, synthetic_reading);
        assert_eq!(bench.results().0, fitted_bits(&driver));
    }
}
