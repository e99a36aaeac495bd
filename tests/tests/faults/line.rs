//! The line loses, alters, duplicates and swaps bytes, and truncates frames.

use std::io::{self, ErrorKind, Read, Write};
use std::time::{Duration, Instant};

use glimpse_core::error::ErrorCode::{NoReply, RefusedNoScan};
use glimpse_tests::RECIPE;
use glimpse_tests::device::assert_matches_host;
use glimpse_tests::emulator::Emulator;
use glimpse_tests::host::{noiseless_scanner, unseen_material};
use glimpse_tests::noisy_line::NoisyLine;
use glimpse_trainer::scanner::ScannerError;

/// One byte in 100 is lost, altered, duplicated or swapped, or truncates its frame.
#[test]
fn noisy_line_does_not_change_result() {
    let mut emulator = Emulator::boot_default();
    let material = unseen_material(0);
    let mut line = NoisyLine::new(&emulator.serial, 0.01, 1);
    let mut scanner = noiseless_scanner(&material);
    let report = scanner.serve(&mut line).unwrap();
    assert!(line.corrupted > 0);
    assert_matches_host(&report, RECIPE);
    // The next scan uses a line without noise and the same host. If the last reply was corrupted, the device requests
    // it again.
    let report = scanner.serve(&mut emulator.serial).unwrap();
    assert_matches_host(&report, RECIPE);
}

/// With one corrupted byte in ten, few frames arrive. A result is correct or missing. Afterwards, a scan over a line
/// without noise succeeds.
#[test]
fn very_noisy_line_gives_no_wrong_result() {
    let mut emulator = Emulator::boot_default();
    let material = unseen_material(0);
    let line = NoisyLine::new(&emulator.serial, 0.1, 2);
    let mut line = TimeLimited {
        stream: line,
        end: Instant::now() + Duration::from_secs(15),
    };
    match noiseless_scanner(&material).serve(&mut line) {
        Ok(report) => assert_matches_host(&report, RECIPE),
        Err(ScannerError::Device(report))
            if report.code == NoReply as u16 || report.code >= RefusedNoScan as u16 => {}
        Err(ScannerError::Link(error)) => assert_eq!(error.kind(), ErrorKind::TimedOut),
        Err(other) => panic!("{other}"),
    }
    assert!(line.stream.corrupted > 0);
    let mut scanner = noiseless_scanner(&material);
    // The host may refuse a request that the device sent during the noise. Then the second scan succeeds.
    let report = scanner
        .serve(&mut emulator.serial)
        .or_else(|_| scanner.serve(&mut emulator.serial));
    assert_matches_host(&report.unwrap(), RECIPE);
}

/// A stream that fails after a point in time.
struct TimeLimited<S> {
    stream: S,
    end: Instant,
}

impl<S: Read> Read for TimeLimited<S> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if Instant::now() > self.end {
            return Err(ErrorKind::TimedOut.into());
        }
        self.stream.read(buffer)
    }
}

impl<S: Write> Write for TimeLimited<S> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.stream.write(bytes)
    }
    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}
