//! The line loses, alters, doubles, swaps and cuts.

use std::io::{self, ErrorKind, Read, Write};
use std::time::{Duration, Instant};

use glimpse_core::error_code::ErrorCode::{NoReply, RefusedNoScan};
use glimpse_tests::RECIPE;
use glimpse_tests::device::assert_agrees;
use glimpse_tests::emulator::Emulator;
use glimpse_tests::host::{scanner, unseen};
use glimpse_tests::line::BadLine;
use glimpse_trainer::scanner::ScannerError;

use super::assert_scans;

/// One byte in a hundred is lost, altered, doubled, swapped with another, or the last of its frame.
#[test]
fn a_bad_line_costs_time_and_nothing_else() {
    let mut emulator = Emulator::boot_as_built();
    let material = unseen(0);
    let mut line = BadLine::new(&emulator.serial, 0.01, 1);
    let mut scanner = scanner(&material);
    let report = scanner.serve(&mut line).unwrap();
    assert!(line.spoiled > 0);
    assert_agrees(&report, RECIPE);
    // And once more over a good one. It is the same host: if its last reply was spoiled, it is asked
    // for again.
    let report = scanner.serve(&mut emulator.serial).unwrap();
    assert_agrees(&report, RECIPE);
}

/// One byte in ten: hardly a frame comes through. Whatever does is right, and once the line is
/// good again so is the scan.
#[test]
fn a_line_that_is_hardly_one_ends_in_no_wrong_result() {
    let mut emulator = Emulator::boot_as_built();
    let material = unseen(0);
    let line = BadLine::new(&emulator.serial, 0.1, 2);
    let mut line = Until {
        stream: line,
        end: Instant::now() + Duration::from_secs(15),
    };
    match scanner(&material).serve(&mut line) {
        Ok(report) => assert_agrees(&report, RECIPE),
        Err(ScannerError::Device(report))
            if matches!(report.error(), Some(NoReply)) || report.code >= RefusedNoScan.code() => {}
        Err(ScannerError::Link(error)) => assert_eq!(error.kind(), ErrorKind::TimedOut),
        Err(other) => panic!("{other}"),
    }
    assert!(line.stream.spoiled > 0);
    let mut scanner = scanner(&material);
    // What was under way when the line became good may be refused once.
    let report = scanner
        .serve(&mut emulator.serial)
        .or_else(|_| scanner.serve(&mut emulator.serial));
    assert_agrees(&report.unwrap(), RECIPE);
}

/// A stream that is over after some time.
struct Until<S> {
    stream: S,
    end: Instant,
}

impl<S: Read> Read for Until<S> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if Instant::now() > self.end {
            return Err(ErrorKind::TimedOut.into());
        }
        self.stream.read(buffer)
    }
}

impl<S: Write> Write for Until<S> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.stream.write(bytes)
    }
    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

/// A stream that writes other bytes than it was given.
struct Altered<S, F> {
    stream: S,
    alter: F,
}

impl<S: Read, F> Read for Altered<S, F> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.stream.read(buffer)
    }
}

impl<S: Write, F: FnMut(&[u8]) -> Vec<u8>> Write for Altered<S, F> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.stream.write_all(&(self.alter)(bytes))?;
        Ok(bytes.len())
    }
    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

/// Every third frame of the host ends in the middle.
#[test]
fn frames_cut_in_the_middle_are_asked_for_again() {
    let emulator = Emulator::boot_as_built();
    let mut writes = 0_usize;
    let mut line = Altered {
        stream: &emulator.serial,
        alter: |bytes: &[u8]| {
            writes += 1;
            let is_cut = writes.is_multiple_of(3);
            bytes[..if is_cut { bytes.len() / 2 } else { bytes.len() }].to_vec()
        },
    };
    let report = scanner(&unseen(3)).serve(&mut line).unwrap();
    assert!(writes > 100, "{writes}");
    assert_agrees(&report, RECIPE);
}

/// Each reply comes twice, and after the reply before it.
#[test]
fn replies_that_come_late_and_twice_and_out_of_order_are_dropped() {
    let mut emulator = Emulator::boot_as_built();
    let mut before = Vec::new();
    let mut line = Altered {
        stream: &emulator.serial,
        alter: |bytes: &[u8]| {
            let both = [&before, &before, bytes, bytes].concat();
            before = bytes.to_vec();
            both
        },
    };
    let report = scanner(&unseen(4)).serve(&mut line).unwrap();
    assert_agrees(&report, RECIPE);
    assert_scans(&mut emulator);
}
