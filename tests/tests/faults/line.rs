//! The line loses, alters, doubles, swaps and cuts.

use std::io::{self, ErrorKind, Read, Write};
use std::time::{Duration, Instant};

use glimpse_core::link::Failure;
use glimpse_tests::RECIPE;
use glimpse_tests::device::assert_agrees;
use glimpse_tests::emulator::Emulator;
use glimpse_tests::host::unseen;
use glimpse_tests::line::BadLine;
use glimpse_trainer::scanner::{ScannerError, ScannerNoise, VirtualScanner};

use super::assert_scans;

/// One byte in a hundred is lost, altered, doubled, swapped with another, or the last of its frame.
#[test]
fn a_bad_line_costs_time_and_nothing_else() {
    let mut emulator = Emulator::boot_as_built();
    let material = unseen(0);
    let mut line = BadLine::new(&emulator.serial, 0.01, 1);
    let mut scanner = VirtualScanner::new(&material, ScannerNoise::default());
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
    match VirtualScanner::new(&material, ScannerNoise::default()).serve(&mut line) {
        Ok(report) => assert_agrees(&report, RECIPE),
        Err(ScannerError::Device(Failure::NoReply | Failure::Refused(_))) => {}
        Err(ScannerError::Link(error)) => assert_eq!(error.kind(), ErrorKind::TimedOut),
        Err(other) => panic!("{other}"),
    }
    assert!(line.stream.spoiled > 0);
    let mut scanner = VirtualScanner::new(&material, ScannerNoise::default());
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

/// Every third frame of the host ends in the middle.
#[test]
fn frames_cut_in_the_middle_are_asked_for_again() {
    let emulator = Emulator::boot_as_built();
    let material = unseen(3);
    let mut line = Cutting {
        stream: &emulator.serial,
        writes: 0,
    };
    let report = VirtualScanner::new(&material, ScannerNoise::default())
        .serve(&mut line)
        .unwrap();
    assert!(line.writes > 100, "{}", line.writes);
    assert_agrees(&report, RECIPE);
}

/// A stream that keeps the second half of every third write to itself.
struct Cutting<S> {
    stream: S,
    writes: usize,
}

impl<S: Read> Read for Cutting<S> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.stream.read(buffer)
    }
}

impl<S: Write> Write for Cutting<S> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writes += 1;
        let cut = self.writes.is_multiple_of(3);
        let sent = if cut { bytes.len() / 2 } else { bytes.len() };
        self.stream.write_all(&bytes[..sent])?;
        Ok(bytes.len())
    }
    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

/// Each reply comes twice, and after the reply before it.
#[test]
fn replies_that_come_late_and_twice_and_out_of_order_are_told_apart() {
    let mut emulator = Emulator::boot_as_built();
    let material = unseen(4);
    let mut line = Stuttering {
        stream: &emulator.serial,
        before: Vec::new(),
    };
    let report = VirtualScanner::new(&material, ScannerNoise::default())
        .serve(&mut line)
        .unwrap();
    assert_agrees(&report, RECIPE);
    assert_scans(&mut emulator);
}

/// A stream that writes all but the first frame after the one before it, and both twice.
struct Stuttering<S> {
    stream: S,
    before: Vec<u8>,
}

impl<S: Read> Read for Stuttering<S> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.stream.read(buffer)
    }
}

impl<S: Write> Write for Stuttering<S> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let all = [&self.before, &self.before, bytes, bytes].concat();
        self.stream.write_all(&all)?;
        self.before = bytes.to_vec();
        Ok(bytes.len())
    }
    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}
