//! The sensor returns invalid or constant values.

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::gonio::Reading;
use glimpse_core::link::{FailureReport, Reply, Request};
use glimpse_core::scan::Residual;
use glimpse_tests::emulator::Emulator;
use glimpse_tests::host::{Response, WELCOME, serve_requests};

use super::assert_scans;

/// Scans with a sensor that is called for each measurement, including repetitions.
fn scan(
    emulator: &mut Emulator,
    mut sensor: impl FnMut(u16) -> Reading,
) -> Result<Residual, FailureReport> {
    let mut result = Err(Error::new(ErrorCode::NoReply).into());
    serve_requests(&mut emulator.serial, |request| match request {
        Request::Hello { .. } => Response::Reply(WELCOME),
        Request::Measure { index, .. } => Response::Reply(Reply::Measured {
            index,
            reading: sensor(index),
        }),
        Request::Finished(residual) => {
            result = Ok(residual);
            Response::Last(Reply::Accepted)
        }
        Request::Failed(report) => {
            result = Err(report);
            Response::Last(Reply::Accepted)
        }
        _ => Response::Reply(Reply::Accepted),
    });
    result
}

/// Returns a plausible reading.
fn valid_reading(index: u16) -> Reading {
    Reading {
        brdf: [0.1 + 0.05 * f32::from(index), 0.2, 0.1],
        saturated: false,
    }
}

#[test]
fn invalid_readings_are_repeated_and_then_reported() {
    use ErrorCode::{ReadingNegative, ReadingNonFinite};
    let mut emulator = Emulator::boot_default();
    for (channel, value, code) in [
        (0, f32::NAN, ReadingNonFinite),
        (1, f32::INFINITY, ReadingNonFinite),
        (2, f32::NEG_INFINITY, ReadingNonFinite),
        (1, -1.1, ReadingNegative),
    ] {
        let invalid_reading = |index| {
            let mut reading = valid_reading(index);
            reading.brdf[channel] = value;
            reading
        };
        // Invalid once or twice: the device repeats the measurement and completes the scan.
        let mut measurements = 0;
        let result = scan(&mut emulator, |index| {
            measurements += 1;
            if [2, 5, 6].contains(&measurements) {
                invalid_reading(index)
            } else {
                valid_reading(index)
            }
        });
        assert!(result.is_ok(), "{result:?}");
        assert_eq!(measurements, 8 + 3);
        // Always invalid: the device reports the error.
        let mut measurements = 0;
        let result = scan(&mut emulator, |index| {
            measurements += 1;
            if index == 2 {
                invalid_reading(index)
            } else {
                valid_reading(index)
            }
        });
        let error = Error::with(code, [2, channel as u32]);
        assert_eq!(result, Err(error.into()));
        assert_eq!(measurements, 2 + 3);
        emulator.wait_for_error(code);
    }
    assert_scans(&mut emulator);
}

#[test]
fn result_counts_saturated_and_repeated_readings() {
    let mut emulator = Emulator::boot_default();
    for (count, first_repeated) in [(0, 8), (1, 5), (8, 1)] {
        let residual = scan(&mut emulator, |index| Reading {
            saturated: index < count,
            ..valid_reading(index.min(first_repeated - 1))
        })
        .unwrap();
        assert_eq!(
            (residual.saturated, residual.repeated),
            (count, 8 - first_repeated)
        );
    }
}

#[test]
fn dark_readings_are_fitted_and_counts_are_reported() {
    let mut emulator = Emulator::boot_default();
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
                report.code == ErrorCode::ReadingsTooLarge as u16 && value > 0.0,
                "{report} at {value}"
            ),
        }
    }
    assert_scans(&mut emulator);
}
