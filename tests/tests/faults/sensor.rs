//! The sensor returns what cannot be, or always the same.

use glimpse_core::error_code::ErrorCode;
use glimpse_core::link::{Failure, FailureReport, Reply, Request};
use glimpse_core::scan::{Reading, ReadingError, Residual};
use glimpse_tests::emulator::Emulator;
use glimpse_tests::host::{Answer, WELCOME, converse};

use super::assert_scans;

/// Scans with a sensor that returns this for each measurement in turn, repetitions included.
fn scan(
    emulator: &mut Emulator,
    mut sensor: impl FnMut(u16) -> Reading,
) -> Result<Residual, FailureReport> {
    let mut result = Err(Failure::NoReply.into());
    converse(&mut emulator.serial, |request| match request {
        Request::Hello { .. } => Answer::Reply(WELCOME),
        Request::Measure { index, .. } => Answer::Reply(Reply::Measured {
            index,
            reading: sensor(index),
        }),
        Request::Finished(residual) => {
            result = Ok(residual);
            Answer::Last(Reply::Accepted)
        }
        Request::Failed(report) => {
            result = Err(report);
            Answer::Last(Reply::Accepted)
        }
        _ => Answer::Reply(Reply::Accepted),
    });
    result
}

/// What a good sensor might return.
fn good(index: u16) -> Reading {
    Reading {
        brdf: [0.1 + 0.05 * f32::from(index), 0.2, 0.1],
        saturated: false,
    }
}

#[test]
fn nan_infinite_and_negative_measurements_are_taken_again_and_then_given_up_by_name() {
    use ReadingError::{Negative, NonFinite};
    let mut emulator = Emulator::boot_as_built();
    for (channel, value, error) in [
        (0, f32::NAN, NonFinite(0)),
        (1, f32::INFINITY, NonFinite(1)),
        (2, f32::NEG_INFINITY, NonFinite(2)),
        (1, -1.1, Negative(1)),
    ] {
        let bad = |index| {
            let mut reading = good(index);
            reading.brdf[channel] = value;
            reading
        };
        // Wrong once or twice: it is taken again, and the scan is whole.
        let mut taken = 0;
        let result = scan(&mut emulator, |index| {
            taken += 1;
            if [2, 5, 6].contains(&taken) {
                bad(index)
            } else {
                good(index)
            }
        });
        assert!(result.is_ok(), "{result:?}");
        assert_eq!(taken, 8 + 3);
        // Wrong for ever.
        let mut taken = 0;
        let result = scan(&mut emulator, |index| {
            taken += 1;
            if index == 2 { bad(index) } else { good(index) }
        });
        assert_eq!(result, Err(Failure::Reading { index: 2, error }.into()));
        assert_eq!(taken, 2 + 3);
        let _ = emulator.wait_for("Reading { index: 2");
    }
    assert_scans(&mut emulator);
}

#[test]
fn a_saturated_sensor_is_told_with_the_result() {
    let mut emulator = Emulator::boot_as_built();
    for many in [0, 1, 8] {
        let result = scan(&mut emulator, |index| Reading {
            saturated: index < many,
            ..good(index)
        });
        assert_eq!(result.unwrap().saturated, many);
    }
}

#[test]
fn a_stuck_sensor_is_told_with_the_result() {
    let mut emulator = Emulator::boot_as_built();
    assert_eq!(scan(&mut emulator, good).unwrap().repeated, 0);
    // From the fifth measurement on, and always.
    let stuck = scan(&mut emulator, |index| good(index.min(4)));
    assert_eq!(stuck.unwrap().repeated, 3);
    let stuck = scan(&mut emulator, |_| good(0));
    assert_eq!(stuck.unwrap().repeated, 7);
}

/// A dark reading is noisy itself: what is slightly below 0 is taken.
#[test]
fn a_reading_slightly_below_zero_is_taken() {
    let mut emulator = Emulator::boot_as_built();
    let mut taken = 0;
    let result = scan(&mut emulator, |index| {
        taken += 1;
        let mut reading = good(index);
        reading.brdf[1] = -0.001;
        reading
    });
    assert!(result.is_ok(), "{result:?}");
    assert_eq!(taken, 8);
}

#[test]
fn a_sensor_in_the_dark_ends_in_a_finite_result_and_one_that_tells_counts_by_name() {
    let mut emulator = Emulator::boot_as_built();
    for value in [0.0, 4095.0, f32::MAX] {
        let result = scan(&mut emulator, |_| Reading {
            brdf: [value; 3],
            saturated: value > 0.0,
        });
        match result {
            Ok(residual) => assert!(
                residual.mean.is_finite() && residual.worst.is_finite() && value == 0.0,
                "{residual:?} at {value}"
            ),
            Err(report) => assert!(
                report.error() == Some(ErrorCode::TooLarge) && value > 0.0,
                "{report} at {value}"
            ),
        }
    }
    assert_scans(&mut emulator);
}
