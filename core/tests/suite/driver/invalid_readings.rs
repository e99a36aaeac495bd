//! Invalid readings are requested again, and then reported.

use glimpse_core::driver::{Action, Config, Host};
use glimpse_core::link::{Failure, Reply, Request};
use glimpse_core::scan::{Reading, ReadingError};

use super::bench::{Bench, default_reply, is_failed, is_finished, phong_driver};
use super::failures::check_after_failure;
use crate::scanning::synthetic_reading;

/// In version 0.1, a reply with an invalid reading was ignored, and led to `NoReply`.
#[test]
fn invalid_reading_is_requested_three_times() {
    for invalid_readings in 0..5 {
        let mut driver = phong_driver(Config::new(Host::Measures));
        let mut remaining = invalid_readings;
        let mut requested = 0;
        let mut bench = Bench::new(|request| match request {
            Request::Measure { index: 4, .. } => {
                requested += 1;
                let reading = match remaining {
                    0 => synthetic_reading(4),
                    _ => Reading::new([0.1, f32::NAN, 0.1]),
                };
                remaining = u32::saturating_sub(remaining, 1);
                Some(Reply::Measured { index: 4, reading })
            }
            _ => Some(default_reply(request)),
        });
        let is_end = |action: &Action| is_finished(action) || is_failed(action);
        let (at, last) = bench.run(&mut driver, is_end);
        drop(bench);
        assert_eq!(at, 0);
        if invalid_readings < 3 {
            assert!(is_finished(&last));
            assert_eq!(requested, invalid_readings + 1);
        } else {
            let (index, error) = (4, ReadingError::NonFinite(1));
            assert_eq!(last, Action::Failed(Failure::Reading { index, error }));
            assert_eq!(requested, 3);
        }
    }
}

/// Every sample may have two invalid readings.
#[test]
fn attempts_are_counted_per_sample() {
    for host in [Host::Measures, Host::Listens, Host::Absent] {
        let mut driver = phong_driver(Config::new(host));
        let mut turn = 0;
        let sensor = move |index| {
            turn += 1;
            match turn % 3 {
                0 => synthetic_reading(index),
                _ => Reading::monochrome(-7.0),
            }
        };
        let mut of_host = sensor;
        let mut bench = Bench::new(move |request| match request {
            Request::Measure { index, .. } => {
                let (index, reading) = (*index, of_host(*index));
                Some(Reply::Measured { index, reading })
            }
            _ => Some(default_reply(request)),
        });
        bench.sensor = Box::new(sensor);
        bench.run(&mut driver, is_finished);
        assert_eq!(bench.take_actions().len(), 9);
    }
}

#[test]
fn invalid_readings_of_own_sensor_fail() {
    for host in [Host::Listens, Host::Absent] {
        let mut driver = phong_driver(Config::new(host));
        let mut bench = Bench::cooperative();
        bench.sensor = Box::new(|index| match index {
            2 => Reading::monochrome(-7.0),
            _ => synthetic_reading(index),
        });
        bench.run(&mut driver, is_failed);
        let (index, error) = (2, ReadingError::Negative(0));
        let failure = Failure::Reading { index, error };
        check_after_failure(host, &mut bench, &mut driver, failure);
    }
}

#[test]
fn reading_of_unknown_sample_fails() {
    let mut driver = phong_driver(Config::new(Host::Absent));
    driver.poll(0);
    for _ in 0..3 {
        assert!(!is_failed(&driver.poll(0)));
        driver.record(8, synthetic_reading(0));
    }
    let (index, samples) = (8, 8);
    let error = ReadingError::Index { index, samples };
    let failure = Failure::Reading { index, error };
    assert_eq!(driver.poll(0), Action::Failed(failure));
}

/// Two invalid readings in one scan do not count in the next scan.
#[test]
fn restart_resets_attempts() {
    let mut driver = phong_driver(Config::new(Host::Absent));
    for _ in 0..3 {
        for _ in 0..2 {
            while !matches!(driver.poll(0), Action::Measure { .. }) {}
            driver.record(0, Reading::monochrome(f32::NAN));
        }
        driver.restart();
    }
    Bench::cooperative().run(&mut driver, is_finished);
}
