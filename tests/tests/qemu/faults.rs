//! Faults of the firmware's environment: one test for each part of the firmware that core's tests in virtual time do not
//! contain (serial line, storage, clock, recipe in flash).

use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::Instant;

use glimpse_core::error::ErrorCode;
use glimpse_core::link::{FrameReader, Purpose, Request};
use glimpse_fitting::scanner::{ScanReport, ScannerError, VirtualScanner};
use glimpse_materials::Brdf;
use glimpse_tests::RECIPE;
use glimpse_tests::device::assert_matches_host;
use glimpse_tests::emulator::Emulator;
use glimpse_tests::host::{noiseless_scanner, unseen_material};
use glimpse_tests::noisy_line::NoisyLine;

/// One byte in 100 is corrupted.
#[test]
fn noisy_line_does_not_change_result() {
    let mut emulator = Emulator::boot();
    let material = unseen_material(0);
    let mut line = NoisyLine::new(&emulator.serial, 100, 1);
    let mut scanner = noiseless_scanner(&material);
    let report = scanner.serve(&mut line).unwrap();
    assert!(line.corrupted > 0);
    assert_matches_host(&report, RECIPE);
    // The next scan uses a line without noise and the same host. If the last reply was corrupted, the device requests
    // it again.
    let report = scanner.serve(&mut emulator.serial).unwrap();
    assert_matches_host(&report, RECIPE);
}

#[test]
fn reports_damaged_recipe() {
    let mut recipe = RECIPE.to_vec();
    recipe[RECIPE.len() / 3] ^= 0x10;
    let mut emulator = Emulator::boot_recipe(&recipe);
    let material = unseen_material(0);
    match noiseless_scanner(&material).serve(&mut emulator.serial) {
        Err(ScannerError::Device(report)) => {
            assert_eq!(report.code, ErrorCode::RecipeChecksum);
        }
        other => panic!("{other:?}"),
    }
    let _ = emulator.wait_for("Error { code: \"RecipeChecksum\"");
}

/// Without instruction counting, QEMU's time is the wall clock's.
#[test]
fn requests_repeat_every_100_ms_by_wall_clock() {
    let mut emulator = Emulator::boot_with(&[]);
    let mut reader = FrameReader::default();
    let mut requests = Vec::new();
    let mut byte = [0];
    while requests.len() <= 20 {
        emulator.serial.read_exact(&mut byte).unwrap();
        if let Some(Ok((_, Request::Hello { .. }))) = reader.push::<Request>(byte[0]) {
            requests.push(Instant::now());
        }
    }
    let pairs = requests.windows(2);
    let mut intervals: Vec<_> = pairs.map(|pair| pair[1] - pair[0]).collect();
    // The median, because other programs may delay QEMU.
    intervals.sort();
    let median = intervals[intervals.len() / 2].as_secs_f64();
    assert!((0.095..0.105).contains(&median), "{intervals:?}");
}

/// A monitor of the device's serial line. It fails at the first request for which `stops` is true, so the host does not
/// receive that request.
struct MonitoredLine<'a> {
    stream: &'a TcpStream,
    reader: FrameReader,
    requests: Vec<Request>,
    stops: &'a dyn Fn(&Request) -> bool,
}

impl Read for MonitoredLine<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.stream.read(buffer)?;
        for byte in &buffer[..count] {
            if let Some(Ok((_, request))) = self.reader.push::<Request>(*byte) {
                if (self.stops)(&request) {
                    return Err(ErrorKind::ConnectionAborted.into());
                }
                self.requests.push(request);
            }
        }
        Ok(count)
    }
}

impl Write for MonitoredLine<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.stream.write(bytes)
    }
    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

/// Serves the device until a request for which `stops` is true, or until the scan is complete. Returns the requests
/// before that, and the report of a complete scan.
fn serve(
    emulator: &Emulator,
    scanner: &mut VirtualScanner<'_>,
    stops: impl Fn(&Request) -> bool,
) -> (Vec<Request>, Option<ScanReport>) {
    let mut line = MonitoredLine {
        stream: &emulator.serial,
        reader: FrameReader::default(),
        requests: Vec::new(),
        stops: &stops,
    };
    let report = match scanner.serve(&mut line) {
        Ok(report) => Some(report),
        Err(ScannerError::Link(error)) if error.kind() == ErrorKind::ConnectionAborted => None,
        Err(error) => panic!("{error}"),
    };
    // Skips requests that were sent before the reset.
    let is_hello = |request: &Request| matches!(request, Request::Hello { .. });
    let start = line.requests.iter().position(is_hello).unwrap_or_default();
    (line.requests.split_off(start), report)
}

/// Returns true for the request of a sample.
fn measures(request: &Request, sample: u16) -> bool {
    let purpose = Purpose::Sample;
    matches!(request, Request::Measure { purpose: p, index, .. } if (*p, *index) == (purpose, sample))
}

/// Returns the samples whose readings the device has saved, and the samples that it requests to measure.
fn indices(requests: &[Request]) -> (Vec<u16>, Vec<u16>) {
    let (mut saved, mut requested) = (Vec::new(), Vec::new());
    for request in requests {
        match request {
            Request::Restored { index, .. } => saved.push(*index),
            Request::Measure {
                purpose: Purpose::Sample,
                index,
                ..
            } => requested.push(*index),
            _ => {}
        }
    }
    // The line has no noise, but the device repeats a request if the host is slow.
    saved.dedup();
    requested.dedup();
    (saved, requested)
}

/// Resets the device ten times in one scan: before each reading, in the fit, and while it sends the result.
#[test]
fn scan_continues_after_resets_without_repeating_readings() {
    let mut emulator = Emulator::boot();
    let material = unseen_material(0);
    let mut scanner = noiseless_scanner(&material);
    for next in 0..8_u16 {
        let (requests, report) = serve(&emulator, &mut scanner, |request| measures(request, next));
        assert!(report.is_none());
        let saved = next.saturating_sub(1);
        let expected = ((0..saved).collect(), (saved..next).collect());
        assert_eq!(indices(&requests), expected);
        emulator.reset();
    }
    let is_half_fitted = |request: &Request| match request {
        Request::Progress(progress) => 2 * progress.done > progress.total,
        _ => false,
    };
    let (requests, report) = serve(&emulator, &mut scanner, is_half_fitted);
    assert!(report.is_none());
    assert_eq!(indices(&requests), ((0..7).collect(), vec![7]));
    emulator.reset();

    let has_sent_64_values =
        |request: &Request| matches!(request, Request::Values { offset: 64, .. });
    let (requests, report) = serve(&emulator, &mut scanner, has_sent_64_values);
    assert!(report.is_none());
    assert_eq!(indices(&requests), ((0..8).collect(), vec![]));
    let progress = requests.iter().find_map(|request| match request {
        Request::Progress(progress) => Some(progress.done),
        _ => None,
    });
    assert_eq!(progress, Some(8), "the fit did not restart");
    emulator.reset();

    let (requests, report) = serve(&emulator, &mut scanner, |_| false);
    assert_eq!(indices(&requests), ((0..8).collect(), vec![]));
    let report = report.unwrap();
    assert_matches_host(&report, RECIPE);
    for reading in &report.readings {
        assert_eq!(reading.reading.brdf, material.at_angles(reading.angles));
    }
}
