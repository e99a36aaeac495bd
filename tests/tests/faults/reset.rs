//! The device is reset, anywhere in a scan: by its watchdog, its button, a dip of the supply.

use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpStream;

use glimpse_core::link::{FrameReader, Request};
use glimpse_materials::Material;
use glimpse_tests::RECIPE;
use glimpse_tests::device::assert_agrees;
use glimpse_tests::emulator::Emulator;
use glimpse_tests::host::{scanner, unseen};
use glimpse_trainer::scanner::{ScanReport, ScannerError, VirtualScanner};

/// The device's serial line, overheard until a certain request, which nobody hears any more.
struct Overheard<'a> {
    stream: &'a TcpStream,
    reader: FrameReader,
    requests: Vec<Request>,
    last: &'a dyn Fn(&Request) -> bool,
}

impl Read for Overheard<'_> {
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

impl Write for Overheard<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.stream.write(bytes)
    }
    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

/// What the device asked until a certain request, or until the scan was whole.
fn serve(
    emulator: &Emulator,
    scanner: &mut VirtualScanner<'_>,
    last: impl Fn(&Request) -> bool,
) -> (Vec<Request>, Option<ScanReport>) {
    let mut line = Overheard {
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
    // What the device still said before it was reset is not of interest.
    let hello = |request: &Request| matches!(request, Request::Hello { .. });
    let begin = line.requests.iter().position(hello).unwrap_or_default();
    (line.requests.split_off(begin), report)
}

/// Indices of the measurements that the device has kept, and of those that it asks for.
fn indices(requests: &[Request]) -> (Vec<u16>, Vec<u16>) {
    let (mut kept, mut measured) = (Vec::new(), Vec::new());
    for request in requests {
        match request {
            Request::Saved { index, .. } => kept.push(*index),
            Request::Measure { index, .. } => measured.push(*index),
            _ => {}
        }
    }
    // The line is good, but a request may be repeated while the host is slow.
    kept.dedup();
    measured.dedup();
    (kept, measured)
}

/// One scan with ten resets: before each measurement, in the fit, and while the result is told.
#[test]
fn a_scan_goes_on_where_resets_stopped_it_and_measures_nothing_twice() {
    let mut emulator = Emulator::boot_as_built();
    let material = unseen(0);
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
    let half = |request: &Request| matches!(request, Request::Progress(progress) if 2 * progress.done > progress.total);
    let (requests, report) = serve(&emulator, &mut scanner, half);
    assert!(report.is_none());
    assert_eq!(indices(&requests), ((0..7).collect(), vec![7]));
    emulator.reset();

    let told = |request: &Request| matches!(request, Request::Values { offset: 64, .. });
    let (requests, report) = serve(&emulator, &mut scanner, told);
    assert!(report.is_none());
    assert_eq!(indices(&requests), ((0..8).collect(), vec![]));
    let progress = requests.iter().find_map(|request| match request {
        Request::Progress(progress) => Some(progress.done),
        _ => None,
    });
    assert_eq!(progress, Some(8), "the fit begins anew");
    emulator.reset();

    let (requests, report) = serve(&emulator, &mut scanner, |_| false);
    assert_eq!(indices(&requests), ((0..8).collect(), vec![]));
    let report = report.unwrap();
    assert_agrees(&report, RECIPE);
    for taken in &report.readings {
        assert_eq!(taken.reading.brdf, material.brdf(taken.angles));
    }
}

/// Nobody knows what lies in the scanner now: the host that comes after the reset refuses.
#[test]
fn measurements_of_a_material_that_was_changed_are_taken_anew() {
    let mut emulator = Emulator::boot_as_built();
    let material = unseen(0);
    let fifth = |request: &Request| matches!(request, Request::Measure { index: 5, .. });
    serve(&emulator, &mut scanner(&material), fifth);
    emulator.reset();

    let changed = unseen(1);
    let mut scanner = scanner(&changed);
    // If a last word from before the reset is refused, that is not the device's any more.
    let (requests, report) = serve(&emulator, &mut scanner, |_| false);
    assert_eq!(indices(&requests), (vec![0], (0..8).collect()));
    emulator.wait_until(|log| log.iter().any(|line| line.contains("readings are deleted")));
    let report = report.unwrap();
    assert_agrees(&report, RECIPE);
    for taken in &report.readings {
        assert_eq!(taken.reading.brdf, changed.brdf(taken.angles));
    }
}

#[test]
fn nothing_is_kept_of_a_scan_that_is_over() {
    let mut emulator = Emulator::boot_as_built();
    let material = unseen(0);
    let mut scanner = scanner(&material);
    let (_, report) = serve(&emulator, &mut scanner, |_| false);
    assert!(report.is_some());
    // The device has heard that the scan is over once it greets again.
    let hello = |request: &Request| matches!(request, Request::Hello { .. });
    serve(&emulator, &mut scanner, hello);
    emulator.reset();
    let (requests, report) = serve(&emulator, &mut scanner, |_| false);
    assert_eq!(indices(&requests), (vec![], (0..8).collect()));
    assert_agrees(&report.unwrap(), RECIPE);
}
