//! The device is reset at any point of a scan, as by its watchdog, its button or a voltage drop.

use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpStream;

use glimpse_core::link::{FrameReader, Request};
use glimpse_materials::Material;
use glimpse_tests::RECIPE;
use glimpse_tests::device::assert_matches_host;
use glimpse_tests::emulator::Emulator;
use glimpse_tests::host::{scanner, unseen_material};
use glimpse_trainer::scanner::{ScanReport, ScannerError, VirtualScanner};

/// A monitor of the device's serial line. It fails at the first request for which `last` is true, so the host does not
/// receive that request.
struct MonitoredLine<'a> {
    stream: &'a TcpStream,
    reader: FrameReader,
    requests: Vec<Request>,
    last: &'a dyn Fn(&Request) -> bool,
}

impl Read for MonitoredLine<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.stream.read(buffer)?;
        for byte in &buffer[..count] {
            if let Some(Ok((_, request))) = self.reader.push::<Request>(*byte) {
                if (self.last)(&request) {
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

/// Serves the device until the request `last`, or until the scan is complete. Returns the requests and the report.
fn serve(
    emulator: &Emulator,
    scanner: &mut VirtualScanner<'_>,
    last: impl Fn(&Request) -> bool,
) -> (Vec<Request>, Option<ScanReport>) {
    let mut line = MonitoredLine {
        stream: &emulator.serial,
        reader: FrameReader::new(),
        requests: Vec::new(),
        last: &last,
    };
    let report = match scanner.serve(&mut line) {
        Ok(report) => Some(report),
        Err(ScannerError::Link(error)) if error.kind() == ErrorKind::ConnectionAborted => None,
        Err(error) => panic!("{error}"),
    };
    // Skips requests from before the reset.
    let hello = |request: &Request| matches!(request, Request::Hello { .. });
    let start = line.requests.iter().position(hello).unwrap_or_default();
    (line.requests.split_off(start), report)
}

/// Returns the samples of the readings that the device has saved, and of those that it requests.
fn indices(requests: &[Request]) -> (Vec<u16>, Vec<u16>) {
    let (mut saved, mut measured) = (Vec::new(), Vec::new());
    for request in requests {
        match request {
            Request::Saved { index, .. } => saved.push(*index),
            Request::Measure { index, .. } => measured.push(*index),
            _ => {}
        }
    }
    // The line is good, but the device may repeat a request while the host is slow.
    saved.dedup();
    measured.dedup();
    (saved, measured)
}

/// Resets one scan ten times: before each reading, in the fit, and while the result is sent.
#[test]
fn scan_continues_after_resets_without_repeating_readings() {
    let mut emulator = Emulator::boot_default();
    let material = unseen_material(0);
    let mut scanner = scanner(&material);
    for next in 0..8_u16 {
        let (requests, report) = serve(
            &emulator,
            &mut scanner,
            |request| matches!(request, Request::Measure { index, .. } if *index == next),
        );
        assert!(report.is_none());
        let before = next.saturating_sub(1);
        let expected = ((0..before).collect(), (before..next).collect());
        assert_eq!(indices(&requests), expected);
        emulator.reset();
    }
    let half_fitted = |request: &Request| matches!(request, Request::Progress(progress) if 2 * progress.done > progress.total);
    let (requests, report) = serve(&emulator, &mut scanner, half_fitted);
    assert!(report.is_none());
    assert_eq!(indices(&requests), ((0..7).collect(), vec![7]));
    emulator.reset();

    let some_values = |request: &Request| matches!(request, Request::Values { offset: 64, .. });
    let (requests, report) = serve(&emulator, &mut scanner, some_values);
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
        assert_eq!(reading.reading.brdf, material.brdf(reading.angles));
    }
}

/// The material may have been replaced: the host after the reset refuses the saved readings.
#[test]
fn changed_material_is_read_completely() {
    let mut emulator = Emulator::boot_default();
    let material = unseen_material(0);
    let fifth = |request: &Request| matches!(request, Request::Measure { index: 5, .. });
    serve(&emulator, &mut scanner(&material), fifth);
    emulator.reset();

    let changed = unseen_material(1);
    let mut scanner = scanner(&changed);
    // The host may refuse a request from before the reset, which no longer concerns the device.
    let (requests, report) = serve(&emulator, &mut scanner, |_| false);
    assert_eq!(indices(&requests), (vec![0], (0..8).collect()));
    emulator.wait_until(|log| log.iter().any(|line| line.contains("readings are deleted")));
    let report = report.unwrap();
    assert_matches_host(&report, RECIPE);
    for reading in &report.readings {
        assert_eq!(reading.reading.brdf, changed.brdf(reading.angles));
    }
}

#[test]
fn finished_scan_saves_no_readings() {
    let mut emulator = Emulator::boot_default();
    let material = unseen_material(0);
    let mut scanner = scanner(&material);
    let (_, report) = serve(&emulator, &mut scanner, |_| false);
    assert!(report.is_some());
    // The device has received the last reply when it sends hello again.
    let hello = |request: &Request| matches!(request, Request::Hello { .. });
    serve(&emulator, &mut scanner, hello);
    emulator.reset();
    let (requests, report) = serve(&emulator, &mut scanner, |_| false);
    assert_eq!(indices(&requests), (vec![], (0..8).collect()));
    assert_matches_host(&report.unwrap(), RECIPE);
}
