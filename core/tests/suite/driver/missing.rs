//! Samples that cannot be read: a scan finishes without them or fails, and never hangs.

use glimpse_core::driver::{Action, Config, Host};
use glimpse_core::fit::coefficient_net::MissingPolicy;
use glimpse_core::link::{Failure, Refusal, Reply, Request};
use glimpse_core::recipe::{Recipe, RecipeError};
use glimpse_core::scan::{FitError, Reading, ReadingError, SkipError};

use super::bench::{
    AnyDriver, Bench, ORIGIN, default_reply, is_failed, is_finished, is_measure, new_driver,
    phong_driver,
};
use super::failures::check_failure;
use crate::completion::contents::CompletedContents;
use crate::scanning::{Any, fit, new_scan, record, synthetic_reading};

/// n of the recipes that tolerate missing readings.
const SAMPLES: u16 = 6;

/// Recipes of each model that tolerate missing readings.
pub(crate) fn tolerant_recipes() -> impl Iterator<Item = Recipe<'static>> {
    let all = CompletedContents::all_small(MissingPolicy::Scaled).into_iter();
    all.map(|contents| contents.recipe())
}

/// The bits of a fit with only these readings.
pub(crate) fn fit_bits(
    recipe: Recipe<'static>,
    indices: impl IntoIterator<Item = u16>,
) -> Vec<u32> {
    let mut scan = new_scan::<Any>(recipe);
    record(&mut scan, indices, synthetic_reading);
    fit(&mut scan, &[u32::MAX]).bits().to_vec()
}

/// The bits of the fitted material of a driver.
pub(crate) fn fitted_bits(driver: &AnyDriver) -> Vec<u32> {
    let fitted = driver.scan().unwrap().fitted().unwrap();
    let residual = fitted.residual();
    let numbers = fitted.values().chain([residual.mean, residual.worst]);
    numbers.map(f32::to_bits).collect()
}

fn is_end(action: &Action) -> bool {
    is_finished(action) || is_failed(action)
}

/// Version 0.2 failed repeatedly with `Refused(Directions)`, or hung.
#[test]
fn skips_unreadable_sample() {
    for recipe in tolerant_recipes() {
        for refuses in [false, true] {
            let mut driver = new_driver::<Any>(recipe, Config::new(Host::Measures));
            let mut bench = Bench::new(|request| match request {
                Request::Measure { index: 2 | 5, .. } if refuses => {
                    Some(Reply::Refused(Refusal::Directions))
                }
                Request::Measure {
                    index: index @ (2 | 5),
                    ..
                } => Some(Reply::Skip { index: *index }),
                _ => Some(default_reply(request)),
            });
            bench.run(&mut driver, is_end);
            let expected = fit_bits(recipe, [0, 1, 3, 4]);
            assert_eq!(bench.results(), (expected, 1));
            assert_eq!(bench.count(is_measure), 6, "each is requested once");
            // The next scan requests all of them again.
            bench.requests.clear();
            bench.run(&mut driver, |action| *action == Action::Forget);
            bench.run(&mut driver, is_end);
            assert_eq!(bench.count(is_measure), 6);
        }
    }
}

#[test]
fn host_finishes_early() {
    for recipe in tolerant_recipes() {
        let mut driver = new_driver::<Any>(recipe, Config::new(Host::Measures));
        let mut bench = Bench::new(|request| match request {
            Request::Measure { index: 3, .. } => Some(Reply::FinishEarly),
            _ => Some(default_reply(request)),
        });
        bench.run(&mut driver, is_end);
        assert_eq!(bench.results(), (fit_bits(recipe, 0..3), 1));
        assert_eq!(bench.count(is_measure), 4);
    }
}

#[test]
fn skip_of_required_reading_fails() {
    let failure = Failure::ReadingRequired { index: 3 };
    for reply in [Reply::Skip { index: 3 }, Reply::FinishEarly] {
        let skip = |request: &Request| {
            matches!(request, Request::Measure { index: 3, .. }).then(|| reply.clone())
        };
        check_failure(Host::Measures, skip, failure);
    }
}

/// The failure states that no reading is left to fit.
#[test]
fn scan_without_readings_fails() {
    for recipe in tolerant_recipes() {
        let mut driver = new_driver::<Any>(recipe, Config::new(Host::Measures));
        let mut bench = Bench::new(|request| match request {
            Request::Measure { .. } => Some(Reply::FinishEarly),
            _ => Some(default_reply(request)),
        });
        let (missing, first) = (SAMPLES, 0);
        let failure = Failure::Fit(FitError::Incomplete { missing, first });
        let (_, failed) = bench.run(&mut driver, is_end);
        assert_eq!(failed, Action::Failed(failure));
    }
}

/// Polls until the driver requests a reading of the device's own sensor.
fn poll_until_measure(bench: &mut Bench<'_>, driver: &mut AnyDriver) -> u16 {
    loop {
        let action = driver.poll(ORIGIN + bench.now);
        let bytes = driver.outgoing().to_vec();
        driver.sent(bytes.len());
        for byte in bench.reply_to(&bytes) {
            driver.receive(byte);
        }
        if let Action::Measure { index, .. } = action {
            return index;
        }
        assert!(!is_end(&action), "{action:?}");
    }
}

#[test]
fn device_with_own_arms_skips_and_finishes_early() {
    for recipe in tolerant_recipes() {
        for host in [Host::Listens, Host::Absent] {
            let mut driver = new_driver::<Any>(recipe, Config::new(host));
            let mut bench = Bench::cooperative();
            assert_eq!(poll_until_measure(&mut bench, &mut driver), 0);
            assert_eq!(driver.poll_delay(ORIGIN), None);
            driver.skip(0).unwrap();
            assert_eq!(driver.poll_delay(ORIGIN), Some(0));
            for expected in [1, 2] {
                assert_eq!(poll_until_measure(&mut bench, &mut driver), expected);
                driver.record(expected, synthetic_reading(expected));
            }
            assert_eq!(poll_until_measure(&mut bench, &mut driver), 3);
            driver.finish_early().unwrap();
            assert_eq!(driver.poll_delay(ORIGIN), Some(0));
            bench.sensor = Box::new(|index| panic!("{index} was read"));
            bench.run(&mut driver, is_end);
            assert_eq!(fitted_bits(&driver), fit_bits(recipe, [1, 2]));
        }
    }
}

/// The host may never reply. After the skip, the driver does not wait for its reading.
#[test]
fn skip_cancels_request() {
    for recipe in tolerant_recipes() {
        let mut driver = new_driver::<Any>(recipe, Config::new(Host::Measures));
        let mut bench = Bench::new(|request| match request {
            Request::Measure { index: 1 | 4, .. } => None,
            _ => Some(default_reply(request)),
        });
        for waits_for in [1, 4] {
            while !matches!(bench.requests.last(), Some(Request::Measure { index, .. }) if *index == waits_for)
            {
                bench.step(&mut driver);
            }
            bench.sleep_ms = 0;
            match waits_for {
                1 => driver.skip(1).unwrap(),
                _ => driver.finish_early().unwrap(),
            }
        }
        let (at, _) = bench.run(&mut driver, is_end);
        assert_eq!(at, 0);
        assert_eq!(bench.results(), (fit_bits(recipe, [0, 2, 3]), 1));
    }
}

/// The reading of the requested sample is still needed.
#[test]
fn skip_of_other_sample_keeps_request() {
    let recipe = tolerant_recipes().next().unwrap();
    let mut driver = new_driver::<Any>(recipe, Config::new(Host::Measures));
    let mut bench = Bench::cooperative();
    bench.delay = Box::new(|request| if is_measure(request) { 50 } else { 0 });
    while !matches!(
        bench.requests.last(),
        Some(Request::Measure { index: 1, .. })
    ) {
        bench.step(&mut driver);
    }
    driver.skip(3).unwrap();
    bench.run(&mut driver, is_end);
    assert_eq!(bench.count(is_measure), 5);
    assert_eq!(bench.results(), (fit_bits(recipe, [0, 1, 2, 4, 5]), 1));
}

#[test]
fn three_invalid_readings_skip_sample() {
    let invalid = Reading::monochrome(f32::NAN);
    for recipe in tolerant_recipes() {
        for host in [Host::Measures, Host::Listens, Host::Absent] {
            let mut driver = new_driver::<Any>(recipe, Config::new(host));
            let mut bench = Bench::new(|request| match request {
                Request::Measure { index: 1, .. } => {
                    let (index, reading) = (1, invalid);
                    Some(Reply::Measured { index, reading })
                }
                _ => Some(default_reply(request)),
            });
            bench.sensor = Box::new(move |index| match index {
                1 => invalid,
                _ => synthetic_reading(index),
            });
            bench.run(&mut driver, is_end);
            assert_eq!(fitted_bits(&driver), fit_bits(recipe, [0, 2, 3, 4, 5]));
            if host == Host::Measures {
                assert_eq!(bench.count(is_measure), 5 + 3);
            }
        }
    }
}

/// An invalid second reading does not discard the first one.
#[test]
fn invalid_readings_keep_earlier_reading() {
    let recipe = tolerant_recipes().next().unwrap();
    let mut driver = new_driver::<Any>(recipe, Config::new(Host::Absent));
    let mut bench = Bench::cooperative();
    poll_until_measure(&mut bench, &mut driver);
    driver.record(2, synthetic_reading(2));
    for _ in 0..4 {
        driver.poll(ORIGIN);
        driver.record(2, Reading::monochrome(f32::NAN));
    }
    bench.run(&mut driver, is_end);
    assert_eq!(fitted_bits(&driver), fit_bits(recipe, 0..SAMPLES));
}

#[test]
fn invalid_skip_changes_nothing() {
    let mut driver = phong_driver(Config::new(Host::Absent));
    assert_eq!(driver.skip(0), Err(SkipError::Required));
    assert_eq!(driver.finish_early(), Err(SkipError::Required));
    Bench::cooperative().run(&mut driver, is_finished);

    let recipe = tolerant_recipes().next().unwrap();
    let mut driver = new_driver::<Any>(recipe, Config::new(Host::Absent));
    let (index, samples) = (SAMPLES, SAMPLES);
    assert_eq!(driver.skip(index), Err(SkipError::Index { index, samples }));
    Bench::cooperative().run(&mut driver, is_finished);
    assert_eq!(fitted_bits(&driver), fit_bits(recipe, 0..SAMPLES));

    // After a failure, a skip would belong to the previous material.
    driver.restart();
    driver.fail(Failure::Machine);
    assert_eq!((driver.skip(1), driver.finish_early()), (Ok(()), Ok(())));
    driver.restart();
    assert_eq!(driver.scan().unwrap().pending().count(), SAMPLES.into());

    let failure = Failure::Recipe(RecipeError::Magic);
    let mut driver = AnyDriver::without_scan(failure, Config::new(Host::Measures));
    let (index, samples) = (0, 0);
    assert_eq!(driver.skip(index), Err(SkipError::Index { index, samples }));
    assert_eq!(driver.finish_early(), Ok(()));
}

/// An unknown sample cannot be skipped.
#[test]
fn reading_of_unknown_sample_fails_with_tolerant_recipe() {
    let recipe = tolerant_recipes().next().unwrap();
    let mut driver = new_driver::<Any>(recipe, Config::new(Host::Absent));
    driver.poll(0);
    for _ in 0..3 {
        driver.record(SAMPLES, synthetic_reading(0));
    }
    let (index, samples) = (SAMPLES, SAMPLES);
    let error = ReadingError::Index { index, samples };
    let failure = Failure::Reading { index, error };
    assert_eq!(driver.poll(0), Action::Failed(failure));
}
