//! Readings that cannot be: asked for again, and then given up by name.

use glimpse_core::driver::{Action, Config, Host};
use glimpse_core::link::{Failure, Reply, Request};
use glimpse_core::scan::{Reading, ReadingError};

use super::bench::{Bench, answer, is_failed, is_finished};
use super::failures::{check_aftermath, check_rest};
use super::scanning::material;
use super::silence::with_phong;

/// In version 0.1 an impossible reply was as good as none, and ended in `NoReply`.
#[test]
fn a_reading_that_is_none_is_asked_for_three_times() {
    let error = ReadingError::NonFinite(1);
    let index = 4;
    for bad in 0..5 {
        with_phong(Config::new(Host::Measures), |driver| {
            let mut left = bad;
            let mut asked = 0;
            let mut bench = Bench::new(|request| match request {
                Request::Measure { index: 4, .. } => {
                    asked += 1;
                    let reading = match left {
                        0 => material(4),
                        _ => Reading::new([0.1, f32::NAN, 0.1]),
                    };
                    left = u32::saturating_sub(left, 1);
                    Some(Reply::Measured { index: 4, reading })
                }
                _ => Some(answer(request)),
            });
            bench.run(driver, |action| is_finished(action) || is_failed(action));
            assert_eq!(bench.now, 0);
            let last = bench.take_actions().pop().unwrap();
            drop(bench);
            if bad < 3 {
                assert!(is_finished(&last));
                assert_eq!(asked, bad + 1);
            } else {
                assert_eq!(last, Action::Failed(Failure::Reading { index, error }));
                assert_eq!(asked, 3);
            }
        });
    }
}

/// Two wrong ones of each reading are none too many.
#[test]
fn wrong_readings_are_counted_for_each_sample() {
    for host in [Host::Measures, Host::Listens, Host::Absent] {
        with_phong(Config::new(host), |driver| {
            let mut turn = 0;
            let sensor = move |index| {
                turn += 1;
                if turn % 3 == 0 {
                    material(index)
                } else {
                    Reading::monochrome(-7.0)
                }
            };
            let mut of_host = sensor;
            let mut bench = Bench::new(move |request| match request {
                Request::Measure { index, .. } => {
                    let (index, reading) = (*index, of_host(*index));
                    Some(Reply::Measured { index, reading })
                }
                _ => Some(answer(request)),
            });
            bench.sensor = Box::new(sensor);
            bench.run(driver, is_finished);
            assert_eq!(bench.take_actions().len(), 9);
        });
    }
}

#[test]
fn wrong_readings_of_ones_own_sensor_end_the_scan_too() {
    for host in [Host::Listens, Host::Absent] {
        with_phong(Config::new(host), |driver| {
            let mut bench = Bench::willing();
            bench.sensor = Box::new(|index| match index {
                2 => Reading::monochrome(-7.0),
                _ => material(index),
            });
            bench.run(driver, is_failed);
            let failure = Failure::Reading {
                index: 2,
                error: ReadingError::Negative(0),
            };
            if host == Host::Listens {
                check_aftermath(&mut bench, driver, failure);
            } else {
                assert_eq!(bench.take_actions().pop(), Some(Action::Failed(failure)));
                check_rest(driver);
            }
        });
    }
    // No such sample.
    with_phong(Config::new(Host::Absent), |driver| {
        driver.poll(0);
        for _ in 0..3 {
            assert!(!is_failed(&driver.poll(0)));
            driver.record(8, material(0));
        }
        let (index, samples) = (8, 8);
        let error = ReadingError::Index { index, samples };
        let failure = Failure::Reading { index, error };
        assert_eq!(driver.poll(0), Action::Failed(failure));
    });
}

/// Two wrong readings of one scan do not count in the next.
#[test]
fn a_scan_that_begins_anew_has_all_its_attempts() {
    with_phong(Config::new(Host::Absent), |driver| {
        for _ in 0..3 {
            for _ in 0..2 {
                while !matches!(driver.poll(0), Action::Measure { .. }) {}
                driver.record(0, Reading::monochrome(f32::NAN));
            }
            driver.restart();
        }
        Bench::willing().run(driver, is_finished);
    });
}
