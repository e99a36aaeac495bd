//! The host falls silent, starts anew, refuses, or is another version.

use std::time::Instant;

use glimpse_core::error_code::ErrorCode;
use glimpse_core::link::{Failure, PROTOCOL, Refusal, Reply, Request};
use glimpse_tests::emulator::Emulator;
use glimpse_tests::host::{Answer, WELCOME, converse, measured, scanner, unseen};
use glimpse_trainer::scanner::ScannerError;

use super::assert_scans;

/// A host that was started anew knows of no scan, says so, and is greeted.
#[test]
fn a_host_that_restarts_in_the_middle_of_a_scan_gets_a_whole_one() {
    let mut emulator = Emulator::boot_as_built();
    converse(&mut emulator.serial, |request| match request {
        Request::Hello { .. } => Answer::Reply(WELCOME),
        Request::Measure { index: 3, .. } => Answer::Stop,
        Request::Measure { index, .. } => Answer::Reply(measured(index, [0.7; 3])),
        other => panic!("{other:?}"),
    });
    let material = unseen(2);
    let mut scanner = scanner(&material);
    match scanner.serve(&mut emulator.serial) {
        Err(ScannerError::Device(report)) if report.error() == Some(ErrorCode::RefusedNoScan) => {}
        other => panic!("{other:?}"),
    }
    assert_scans(&mut emulator);
}

#[test]
fn a_host_of_another_protocol_is_refused_by_name() {
    let mut emulator = Emulator::boot_as_built();
    let (device, host) = (PROTOCOL, PROTOCOL + 1);
    converse(&mut emulator.serial, |request| match request {
        Request::Failed(report) => {
            assert_eq!(report, Failure::Protocol { device, host }.into());
            Answer::Last(Reply::Accepted)
        }
        _ => Answer::Reply(Reply::Welcome { protocol: host }),
    });
    let _ = emulator.wait_for("Protocol");
    assert_scans(&mut emulator);
}

#[test]
fn directions_out_of_reach_are_given_up_by_name() {
    let mut emulator = Emulator::boot_as_built();
    converse(&mut emulator.serial, |request| match request {
        Request::Hello { .. } => Answer::Reply(WELCOME),
        Request::Measure { .. } => Answer::Reply(Reply::Refused(Refusal::Directions)),
        Request::Failed(report) => {
            assert_eq!(report, Failure::Refused(Refusal::Directions).into());
            Answer::Last(Reply::Accepted)
        }
        other => panic!("{other:?}"),
    });
    let _ = emulator.wait_for("Refused(Directions");
    assert_scans(&mut emulator);
}

#[test]
fn a_host_that_falls_silent_in_the_fit_is_given_up_and_greeted_anew() {
    let mut emulator = Emulator::boot_as_built();
    let begun = Instant::now();
    let mut silent = false;
    converse(&mut emulator.serial, |request| match request {
        Request::Hello { .. } if silent => Answer::Stop,
        Request::Hello { .. } => Answer::Reply(WELCOME),
        Request::Measure { index, .. } => Answer::Reply(measured(index, [0.2; 3])),
        // In the middle of the fit.
        _ => {
            silent = true;
            Answer::Silence
        }
    });
    let seconds = begun.elapsed().as_secs_f64();
    assert!((2.0..45.0).contains(&seconds), "{seconds}");
    let _ = emulator.wait_for("NoReply");
    assert_scans(&mut emulator);
}

/// The motors are stuck: the host hears, and says nothing. The device asks for a minute.
#[test]
fn a_measurement_that_never_comes_is_given_up_by_name() {
    let mut emulator = Emulator::boot_as_built();
    let mut begun = None;
    converse(&mut emulator.serial, |request| match request {
        Request::Hello { .. } if begun.is_some() => Answer::Stop,
        Request::Hello { .. } => Answer::Reply(WELCOME),
        Request::Measure { index: 3, .. } => {
            begun = Some(Instant::now());
            Answer::Silence
        }
        Request::Measure { index, .. } => Answer::Reply(measured(index, [0.2; 3])),
        other => panic!("{other:?}"),
    });
    let seconds = begun.unwrap().elapsed().as_secs_f64();
    assert!((58.0..75.0).contains(&seconds), "{seconds}");
    let _ = emulator.wait_for("NoReply");
    assert_scans(&mut emulator);
}

/// What a reset would keep, a host that falls silent does not cost: it is offered at the next hello.
#[test]
fn measurements_outlast_a_host_that_falls_silent() {
    let mut emulator = Emulator::boot_as_built();
    let value = |index: u16| [0.2 + 0.01 * f32::from(index); 3];
    let mut silent = false;
    let mut kept = Vec::new();
    converse(&mut emulator.serial, |request| match request {
        Request::Hello { .. } => Answer::Reply(WELCOME),
        Request::Measure { index, .. } if !silent => Answer::Reply(measured(index, value(index))),
        // The first slice of the fit.
        Request::Progress(_) if kept.is_empty() => {
            silent = true;
            Answer::Silence
        }
        Request::Saved { index, reading } => {
            assert_eq!(reading.brdf, value(index));
            kept.push(index);
            Answer::Reply(Reply::Accepted)
        }
        Request::Progress(_) => Answer::Last(Reply::Accepted),
        other => panic!("{other:?}"),
    });
    assert_eq!(kept, (0..8).collect::<Vec<u16>>());
}
