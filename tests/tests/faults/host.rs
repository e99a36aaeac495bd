//! The host stops responding, restarts, refuses requests, or has another version.

use std::time::Instant;

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::link::{PROTOCOL, Reply, Request};
use glimpse_tests::emulator::Emulator;
use glimpse_tests::host::{
    Response, WELCOME, measured_reply, noiseless_scanner, serve_requests, unseen_material,
};
use glimpse_trainer::scanner::ScannerError;

use super::assert_scans;

/// A restarted host does not know the scan. It refuses the request, and the device sends hello again.
#[test]
fn restarted_host_receives_complete_scan() {
    let mut emulator = Emulator::boot_default();
    serve_requests(&mut emulator.serial, |request| match request {
        Request::Hello { .. } => Response::Reply(WELCOME),
        Request::Measure { index: 3, .. } => Response::Stop,
        Request::Measure { index, .. } => Response::Reply(measured_reply(index, [0.7; 3])),
        other => panic!("{other:?}"),
    });
    let material = unseen_material(2);
    let mut scanner = noiseless_scanner(&material);
    match scanner.serve(&mut emulator.serial) {
        Err(ScannerError::Device(report)) if report.code == ErrorCode::RefusedNoScan as u16 => {}
        other => panic!("{other:?}"),
    }
    assert_scans(&mut emulator);
}

#[test]
fn reports_protocol_of_other_version() {
    let mut emulator = Emulator::boot_default();
    let host = PROTOCOL + 1;
    let error = Error::with(ErrorCode::Protocol, [PROTOCOL.into(), host.into()]);
    serve_requests(&mut emulator.serial, |request| match request {
        Request::Failed(report) => {
            assert_eq!(report, error.into());
            Response::Last(Reply::Accepted)
        }
        _ => Response::Reply(Reply::Welcome { protocol: host }),
    });
    emulator.wait_for_error(ErrorCode::Protocol);
    assert_scans(&mut emulator);
}

#[test]
fn device_sends_hello_again_if_host_is_silent_during_fit() {
    let mut emulator = Emulator::boot_default();
    let start = Instant::now();
    let mut silent = false;
    serve_requests(&mut emulator.serial, |request| match request {
        Request::Hello { .. } if silent => Response::Stop,
        Request::Hello { .. } => Response::Reply(WELCOME),
        Request::Measure { index, .. } => Response::Reply(measured_reply(index, [0.2; 3])),
        // A request during the fit.
        _ => {
            silent = true;
            Response::Silence
        }
    });
    let seconds = start.elapsed().as_secs_f64();
    assert!((2.0..45.0).contains(&seconds), "{seconds}");
    emulator.wait_for_error(ErrorCode::NoReply);
    assert_scans(&mut emulator);
}

/// The motors are stuck, so the host receives requests and does not reply. The device repeats its request for 60 s.
#[test]
fn reports_measurement_without_reply() {
    let mut emulator = Emulator::boot_default();
    let mut first_request = None;
    serve_requests(&mut emulator.serial, |request| match request {
        Request::Hello { .. } if first_request.is_some() => Response::Stop,
        Request::Hello { .. } => Response::Reply(WELCOME),
        Request::Measure { index: 3, .. } => {
            first_request = Some(Instant::now());
            Response::Silence
        }
        Request::Measure { index, .. } => Response::Reply(measured_reply(index, [0.2; 3])),
        other => panic!("{other:?}"),
    });
    let seconds = first_request.unwrap().elapsed().as_secs_f64();
    assert!((58.0..75.0).contains(&seconds), "{seconds}");
    emulator.wait_for_error(ErrorCode::NoReply);
    assert_scans(&mut emulator);
}

/// Readings are saved when the host stops responding, as after a reset. The device offers them after the next hello.
#[test]
fn readings_are_kept_when_host_stops_responding() {
    let mut emulator = Emulator::boot_default();
    let value = |index: u16| [0.2 + 0.01 * f32::from(index); 3];
    let mut silent = false;
    let mut saved = Vec::new();
    serve_requests(&mut emulator.serial, |request| match request {
        Request::Hello { .. } => Response::Reply(WELCOME),
        Request::Measure { index, .. } if !silent => {
            Response::Reply(measured_reply(index, value(index)))
        }
        // The first steps of the fit.
        Request::Progress(_) if saved.is_empty() => {
            silent = true;
            Response::Silence
        }
        Request::Saved { index, reading } => {
            assert_eq!(reading.brdf, value(index));
            saved.push(index);
            Response::Reply(Reply::Accepted)
        }
        Request::Progress(_) => Response::Last(Reply::Accepted),
        other => panic!("{other:?}"),
    });
    assert_eq!(saved, (0..8).collect::<Vec<u16>>());
}
