//! Timeouts and watchdog: the timing of the firmware with a silent host and with slow arms.

use std::fs;
use std::io::Read;
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use glimpse_core::error::ErrorCode;
use glimpse_core::link::{FrameReader, Reply, Request};
use glimpse_tests::elf::Firmware;
use glimpse_tests::emulator::Emulator;
use glimpse_tests::host::{Response, WELCOME, serve_requests};
use tempfile::NamedTempFile;

use super::assert_scans;

/// Expected interval of requests, in seconds.
const INTERVAL_SECONDS: f64 = 0.1;
/// Largest allowed relative error of the interval.
const TOLERANCE: f64 = 0.05;

/// Without instruction counting, QEMU's time is the wall clock's.
#[test]
fn requests_repeat_every_100_ms_by_wall_clock() {
    let firmware = Firmware::load();
    let mut emulator = Emulator::boot_with(&firmware, firmware.path(), &[]);
    let mut reader = FrameReader::new();
    let mut requests = Vec::new();
    let mut byte = [0];
    while requests.len() <= 40 {
        emulator.serial.read_exact(&mut byte).unwrap();
        if let Some(Ok((_, Request::Hello { .. }))) = reader.push::<Request>(byte[0]) {
            requests.push(Instant::now());
        }
    }
    let mut intervals: Vec<f64> = requests
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).as_secs_f64())
        .collect();
    // The median, because other programs may delay QEMU.
    intervals.sort_by(f64::total_cmp);
    let median = intervals[intervals.len() / 2];
    assert!(
        (median / INTERVAL_SECONDS - 1.0).abs() < TOLERANCE,
        "{median} s: {intervals:?}"
    );
    assert_scans(&mut emulator);
}

/// Returns the number of times the watchdog was fed. QEMU does not emulate the watchdog, but logs writes to its
/// registers.
fn watchdog_feeds(log: &Path) -> usize {
    let log = fs::read_to_string(log).unwrap();
    log.matches("value 0x0000aaaa").count()
}

/// The arms move for 6 s, longer than the watchdog's timeout. Then the device fails.
#[test]
fn watchdog_is_fed_during_motion_and_after_failure() {
    let log = NamedTempFile::new().unwrap();
    let firmware = Firmware::load();
    let options = ["-icount", "shift=0", "-d", "unimp", "-D"];
    let options = [&options[..], &[log.path().to_str().unwrap()]].concat();
    let mut emulator = Emulator::boot_with(&firmware, firmware.path(), &options);

    let mut feeds = Vec::new();
    let mut feeds_at_failure = None;
    serve_requests(&mut emulator.serial, |request| match request {
        Request::Hello { .. } if feeds_at_failure.is_some() => Response::Stop,
        Request::Hello { .. } => Response::Reply(WELCOME),
        Request::Measure { .. } => {
            for _ in 0..12 {
                feeds.push(watchdog_feeds(log.path()));
                thread::sleep(Duration::from_millis(500));
            }
            Response::Reply(Reply::Refused(ErrorCode::RefusedDirections))
        }
        Request::Failed(failure) => {
            assert_eq!(failure.code, ErrorCode::RefusedDirections as u16);
            feeds_at_failure = Some(watchdog_feeds(log.path()));
            Response::Reply(Reply::Accepted)
        }
        other => panic!("{other:?}"),
    });
    assert!(feeds.windows(2).all(|pair| pair[0] < pair[1]), "{feeds:?}");
    // The device then pauses for 0.5 s.
    let feeds_in_pause = watchdog_feeds(log.path()) - feeds_at_failure.unwrap();
    assert!(feeds_in_pause >= 5, "{feeds_in_pause}");
    assert_scans(&mut emulator);
}
