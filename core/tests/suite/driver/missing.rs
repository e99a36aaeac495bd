//! Samples that cannot be read: a scan ends without them, or fails by name, and never hangs.

use glimpse_core::driver::{Action, Config, Host};
use glimpse_core::fit::coefficient_net::MissingPolicy;
use glimpse_core::link::{Failure, Refusal, Reply, Request};
use glimpse_core::recipe::{Recipe, RecipeError};
use glimpse_core::scan::{FitError, Reading, ReadingError, SkipError};

use super::bench::{
    AnyDriver, Bench, ORIGIN, answer, driver_by, is_failed, is_finished, is_measure, phong,
};
use super::failures::fails;
use crate::completion::made::Made;
use crate::scanning::{Any, MODELS, fit, material, record, scan_by};

/// n of the recipes that tolerate missing readings.
const SAMPLES: u16 = 6;

/// A recipe of each model that tolerates missing readings.
pub(crate) fn tolerant() -> impl Iterator<Item = Recipe<'static>> {
    let models = MODELS.into_iter();
    models.map(|model| Made::small(model, MissingPolicy::Scaled).recipe())
}

/// The bits of a fit of these readings alone.
pub(crate) fn fit_of(recipe: Recipe<'static>, indices: impl IntoIterator<Item = u16>) -> Vec<u32> {
    let mut scan = scan_by::<Any>(recipe);
    record(&mut scan, indices, material);
    fit(&mut scan, &[u32::MAX]).bits().to_vec()
}

/// The bits of the fitted material of a driver.
pub(crate) fn fitted_bits(driver: &AnyDriver) -> Vec<u32> {
    let fitted = driver.scan().unwrap().fitted().unwrap();
    let residual = fitted.residual();
    let numbers = fitted.values().chain([residual.mean, residual.worst]);
    numbers.map(f32::to_bits).collect()
}

fn ends(action: &Action) -> bool {
    is_finished(action) || is_failed(action)
}

/// Version 0.2 failed with `Refused(Directions)`, again and again, or hung.
#[test]
fn a_sample_that_the_host_cannot_read_is_left_out() {
    for recipe in tolerant() {
        for refuses in [false, true] {
            let mut driver = driver_by::<Any>(recipe, Config::new(Host::Measures));
            let mut bench = Bench::new(|request| match request {
                Request::Measure { index: 2 | 5, .. } if refuses => {
                    Some(Reply::Refused(Refusal::Directions))
                }
                Request::Measure {
                    index: index @ (2 | 5),
                    ..
                } => Some(Reply::Skip { index: *index }),
                _ => Some(answer(request)),
            });
            bench.run(&mut driver, ends);
            let expected = fit_of(recipe, [0, 1, 3, 4]);
            assert_eq!(bench.results(), (expected, 1));
            assert_eq!(bench.count(is_measure), 6, "each is asked for once");
            // The next scan asks for all of them again.
            bench.heard.clear();
            bench.run(&mut driver, |action| *action == Action::Forget);
            bench.run(&mut driver, ends);
            assert_eq!(bench.count(is_measure), 6);
        }
    }
}

#[test]
fn a_host_ends_the_readings_early() {
    for recipe in tolerant() {
        let mut driver = driver_by::<Any>(recipe, Config::new(Host::Measures));
        let mut bench = Bench::new(|request| match request {
            Request::Measure { index: 3, .. } => Some(Reply::FinishEarly),
            _ => Some(answer(request)),
        });
        bench.run(&mut driver, ends);
        assert_eq!(bench.results(), (fit_of(recipe, 0..3), 1));
        assert_eq!(bench.count(is_measure), 4);
    }
}

#[test]
fn a_skipped_sample_of_a_recipe_that_needs_it_fails_by_name() {
    let failure = Failure::ReadingRequired { index: 3 };
    for reply in [Reply::Skip { index: 3 }, Reply::FinishEarly] {
        let skip = |request: &Request| {
            matches!(request, Request::Measure { index: 3, .. }).then(|| reply.clone())
        };
        fails(Host::Measures, skip, failure);
    }
}

/// Nothing is left to fit: the failure states it.
#[test]
fn a_scan_without_any_reading_fails_by_name() {
    for recipe in tolerant() {
        let mut driver = driver_by::<Any>(recipe, Config::new(Host::Measures));
        let mut bench = Bench::new(|request| match request {
            Request::Measure { .. } => Some(Reply::FinishEarly),
            _ => Some(answer(request)),
        });
        let (missing, first) = (SAMPLES, 0);
        let failure = Failure::Fit(FitError::Incomplete { missing, first });
        let (_, failed) = bench.run(&mut driver, ends);
        assert_eq!(failed, Action::Failed(failure));
    }
}

/// Polls until the driver wants a reading of the device's own sensor.
fn until_measure(bench: &mut Bench<'_>, driver: &mut AnyDriver) -> u16 {
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
        assert!(!ends(&action), "{action:?}");
    }
}

#[test]
fn a_device_with_arms_of_its_own_skips_and_ends_early() {
    for recipe in tolerant() {
        for host in [Host::Listens, Host::Absent] {
            let mut driver = driver_by::<Any>(recipe, Config::new(host));
            let mut bench = Bench::willing();
            assert_eq!(until_measure(&mut bench, &mut driver), 0);
            assert_eq!(driver.poll_delay(ORIGIN), None);
            driver.skip(0).unwrap();
            assert_eq!(driver.poll_delay(ORIGIN), Some(0));
            for expected in [1, 2] {
                assert_eq!(until_measure(&mut bench, &mut driver), expected);
                driver.record(expected, material(expected));
            }
            assert_eq!(until_measure(&mut bench, &mut driver), 3);
            driver.finish_early().unwrap();
            assert_eq!(driver.poll_delay(ORIGIN), Some(0));
            bench.sensor = Box::new(|index| panic!("{index} was read"));
            bench.run(&mut driver, ends);
            assert_eq!(fitted_bits(&driver), fit_of(recipe, [1, 2]));
        }
    }
}

/// The host may never reply: the driver no longer waits for its reading.
#[test]
fn a_skip_ends_the_wait_for_the_host() {
    for recipe in tolerant() {
        let mut driver = driver_by::<Any>(recipe, Config::new(Host::Measures));
        let mut bench = Bench::new(|request| match request {
            Request::Measure { index: 1 | 4, .. } => None,
            _ => Some(answer(request)),
        });
        for waits_for in [1, 4] {
            while !matches!(bench.heard.last(), Some(Request::Measure { index, .. }) if *index == waits_for)
            {
                bench.turn(&mut driver);
            }
            bench.elapsed = 0;
            match waits_for {
                1 => driver.skip(1).unwrap(),
                _ => driver.finish_early().unwrap(),
            }
        }
        let (at, _) = bench.run(&mut driver, ends);
        assert_eq!(at, 0);
        assert_eq!(bench.results(), (fit_of(recipe, [0, 2, 3]), 1));
    }
}

/// A skip of another sample does not: that reading is still wanted.
#[test]
fn a_skip_of_another_sample_keeps_the_request() {
    let recipe = tolerant().next().unwrap();
    let mut driver = driver_by::<Any>(recipe, Config::new(Host::Measures));
    let mut bench = Bench::willing();
    bench.delay = Box::new(|request| if is_measure(request) { 50 } else { 0 });
    while !matches!(bench.heard.last(), Some(Request::Measure { index: 1, .. })) {
        bench.turn(&mut driver);
    }
    driver.skip(3).unwrap();
    bench.run(&mut driver, ends);
    assert_eq!(bench.count(is_measure), 5);
    assert_eq!(bench.results(), (fit_of(recipe, [0, 1, 2, 4, 5]), 1));
}

#[test]
fn three_invalid_readings_skip_a_sample_where_that_is_tolerated() {
    let invalid = Reading::monochrome(f32::NAN);
    for recipe in tolerant() {
        for host in [Host::Measures, Host::Listens, Host::Absent] {
            let mut driver = driver_by::<Any>(recipe, Config::new(host));
            let mut bench = Bench::new(|request| match request {
                Request::Measure { index: 1, .. } => {
                    let (index, reading) = (1, invalid);
                    Some(Reply::Measured { index, reading })
                }
                _ => Some(answer(request)),
            });
            bench.sensor = Box::new(move |index| match index {
                1 => invalid,
                _ => material(index),
            });
            bench.run(&mut driver, ends);
            assert_eq!(fitted_bits(&driver), fit_of(recipe, [0, 2, 3, 4, 5]));
            if host == Host::Measures {
                assert_eq!(bench.count(is_measure), 5 + 3);
            }
        }
    }
}

/// A second reading that is invalid does not cost the first one.
#[test]
fn invalid_readings_of_a_sample_with_a_reading_leave_that_reading() {
    let recipe = tolerant().next().unwrap();
    let mut driver = driver_by::<Any>(recipe, Config::new(Host::Absent));
    let mut bench = Bench::willing();
    until_measure(&mut bench, &mut driver);
    driver.record(2, material(2));
    for _ in 0..4 {
        driver.poll(ORIGIN);
        driver.record(2, Reading::monochrome(f32::NAN));
    }
    bench.run(&mut driver, ends);
    assert_eq!(fitted_bits(&driver), fit_of(recipe, 0..SAMPLES));
}

#[test]
fn a_skip_that_is_impossible_is_an_error_and_changes_nothing() {
    let mut driver = phong(Config::new(Host::Absent));
    assert_eq!(driver.skip(0), Err(SkipError::Required));
    assert_eq!(driver.finish_early(), Err(SkipError::Required));
    Bench::willing().run(&mut driver, is_finished);

    let recipe = tolerant().next().unwrap();
    let mut driver = driver_by::<Any>(recipe, Config::new(Host::Absent));
    let (index, samples) = (SAMPLES, SAMPLES);
    assert_eq!(driver.skip(index), Err(SkipError::Index { index, samples }));
    Bench::willing().run(&mut driver, is_finished);
    assert_eq!(fitted_bits(&driver), fit_of(recipe, 0..SAMPLES));

    // After a failure a skip would be one of the material before.
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

/// A reading of an unknown sample is no reason to skip.
#[test]
fn a_reading_of_an_unknown_sample_fails_by_name_where_skips_are_tolerated() {
    let recipe = tolerant().next().unwrap();
    let mut driver = driver_by::<Any>(recipe, Config::new(Host::Absent));
    driver.poll(0);
    for _ in 0..3 {
        driver.record(SAMPLES, material(0));
    }
    let (index, samples) = (SAMPLES, SAMPLES);
    let error = ReadingError::Index { index, samples };
    let failure = Failure::Reading { index, error };
    assert_eq!(driver.poll(0), Action::Failed(failure));
}
