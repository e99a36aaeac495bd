//! Timeouts: the timing of the firmware with a silent host.

use std::io::Read;
use std::time::Instant;

use glimpse_core::link::{FrameReader, Request};
use glimpse_tests::elf::Firmware;
use glimpse_tests::emulator::Emulator;

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
