//! The firmware in QEMU, in front of scanners good and bad.

use std::io::{ErrorKind, Read, Write};
use std::time::{Duration, Instant};

use glimpse_core::link::{
    Answerer, FRAME_BYTES, Failure, Heard, PROTOCOL, Refusal, Reply, Request,
};
use glimpse_core::recipe::{Recipe, RecipeError};
use glimpse_core::scan::{Measurement, MeasurementError};
use glimpse_tests::RECIPE;
use glimpse_tests::device::fit;
use glimpse_tests::elf::Firmware;
use glimpse_tests::emulator::Emulator;
use glimpse_tests::line::BadLine;
use glimpse_trainer::evaluation::{Judge, Method};
use glimpse_trainer::material::{Material, Procedural};
use glimpse_trainer::scanner::{Options, ScanReport, ScannerError, VirtualScanner};

/// A material that recipes are not trained on.
fn unseen(index: usize) -> Procedural {
    Procedural::new(index, 0xFEED)
}

fn boot() -> Emulator {
    let firmware = Firmware::load();
    Emulator::boot(&firmware, firmware.path())
}

fn close(device: f32, host: f32) -> bool {
    (device - host).abs() <= 1e-4 * host.abs() + 1e-7
}

/// The device's result is the host's fit of the same measurements.
fn assert_agrees(report: &ScanReport) {
    let recipe = Recipe::parse(RECIPE).unwrap();
    assert_eq!(report.recipe, recipe.checksum());
    assert_eq!(report.measurements.len(), recipe.samples());

    let (parameters, residual) = fit(RECIPE, &report.measurements);
    assert_eq!(report.parameters.len(), parameters.len());
    for (index, (device, host)) in report.parameters.iter().zip(&parameters).enumerate() {
        assert!(
            close(*device, *host),
            "parameter {index}: {device}, on the host {host}"
        );
    }
    assert!(
        close(report.residual.mean, residual.mean) && close(report.residual.worst, residual.worst),
        "{:?}, on the host {residual:?}",
        report.residual
    );
}

#[test]
fn a_scan_loses_what_evaluate_says() {
    let mut emulator = boot();
    let recipe = Recipe::parse(RECIPE).unwrap();
    for index in 0..3 {
        let material = unseen(index);
        let report = VirtualScanner::new(&material, Options::default())
            .serve(&mut emulator.serial)
            .unwrap();
        let materials: [Box<dyn Material>; 1] = [Box::new(material.clone())];
        let verdict = Judge::new(&materials, 0)
            .judge(&Method::ours(&recipe, None).unwrap(), 0, 1)
            .unwrap();
        let (scan, evaluate) = (report.loss(&material, 0), verdict.scores.loss);
        assert!(
            (scan / evaluate - 1.0).abs() < 1e-4,
            "{scan}, evaluate says {evaluate}"
        );
    }
}

#[test]
fn scans_of_unseen_materials_agree_with_the_host_one_after_the_other() {
    let mut emulator = boot();
    for index in 0..3 {
        let material = unseen(index);
        let options = Options {
            noise: 0.02 * index as f32,
            seed: 1,
        };
        let report = VirtualScanner::new(&material, options)
            .serve(&mut emulator.serial)
            .unwrap();
        assert_agrees(&report);
    }
    let instructions: u64 = emulator.wait_for("fit_instructions=").parse().unwrap();
    let stack: u64 = emulator.wait_for("stack_bytes=").parse().unwrap();
    // Broken meters would show zero, or an instruction for each multiplication and fewer.
    assert!(instructions > 282_000, "{instructions}");
    assert!((500..8192).contains(&stack), "{stack}");
}

/// One byte in a hundred is lost, altered, doubled or swapped with another.
#[test]
fn a_bad_line_costs_time_and_nothing_else() {
    let mut emulator = boot();
    let material = unseen(0);
    let mut line = BadLine::new(&emulator.serial, 0.01, 1);
    let report = VirtualScanner::new(&material, Options::default())
        .serve(&mut line)
        .unwrap();
    assert!(line.spoiled > 0);
    assert_agrees(&report);
    // And once more over a good one.
    let report = VirtualScanner::new(&material, Options::default())
        .serve(&mut emulator.serial)
        .unwrap();
    assert_agrees(&report);
}

/// One byte in ten: hardly a frame comes through. Whatever does is right, and once the line is
/// good again so is the scan.
#[test]
fn a_line_that_is_hardly_one_ends_in_no_wrong_result() {
    let mut emulator = boot();
    let material = unseen(0);
    let line = BadLine::new(&emulator.serial, 0.1, 2);
    let mut line = Until {
        stream: line,
        end: Instant::now() + Duration::from_secs(15),
    };
    match VirtualScanner::new(&material, Options::default()).serve(&mut line) {
        Ok(report) => assert_agrees(&report),
        Err(ScannerError::Device(Failure::NoReply | Failure::Refused(_))) => {}
        Err(ScannerError::Link(error)) => assert_eq!(error.kind(), ErrorKind::TimedOut),
        Err(other) => panic!("{other}"),
    }
    assert!(line.stream.spoiled > 0);
    let mut scanner = VirtualScanner::new(&material, Options::default());
    // What was under way when the line became good may be refused once.
    let report = scanner
        .serve(&mut emulator.serial)
        .or_else(|_| scanner.serve(&mut emulator.serial));
    assert_agrees(&report.unwrap());
}

/// A stream that is over after some time.
struct Until<S> {
    stream: S,
    end: Instant,
}

impl<S: Read> Read for Until<S> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        if Instant::now() > self.end {
            return Err(ErrorKind::TimedOut.into());
        }
        self.stream.read(buffer)
    }
}

impl<S: Write> Write for Until<S> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.stream.write(bytes)
    }
    fn flush(&mut self) -> std::io::Result<()> {
        self.stream.flush()
    }
}

/// A host that was started anew knows of no scan, says so, and is greeted.
#[test]
fn a_host_that_restarts_in_the_middle_of_a_scan_gets_a_whole_one() {
    let mut emulator = boot();
    let material = unseen(2);
    converse(&mut emulator, |request| match request {
        Request::Hello { .. } => Some(Some(WELCOME)),
        Request::Measure { index: 3, .. } => None,
        Request::Measure { index, .. } => Some(Some(Reply::Measured {
            index,
            measurement: Measurement {
                brdf: [0.7; 3],
                saturated: false,
            },
        })),
        other => panic!("{other:?}"),
    });
    let mut scanner = VirtualScanner::new(&material, Options::default());
    match scanner.serve(&mut emulator.serial) {
        Err(ScannerError::Device(Failure::Refused(Refusal::NoScan))) => {}
        other => panic!("{other:?}"),
    }
    let report = scanner.serve(&mut emulator.serial).unwrap();
    assert_agrees(&report);
}

/// What the device says of a recipe with some bytes altered.
fn refusal(alter: impl FnOnce(&mut [u8])) -> RecipeError {
    let firmware = Firmware::load();
    let image = firmware.with_recipe(alter);
    let mut emulator = Emulator::boot(&firmware, image.path());
    let material = unseen(0);
    let error = VirtualScanner::new(&material, Options::default())
        .serve(&mut emulator.serial)
        .unwrap_err();
    // The log names it too.
    assert_ne!(emulator.wait_for("Recipe("), "");
    match error {
        ScannerError::Device(Failure::Recipe(error)) => error,
        other => panic!("{other}"),
    }
}

#[test]
fn a_flipped_bit_in_the_recipe_is_refused_by_name() {
    assert_eq!(refusal(|recipe| recipe[2] ^= 0x40), RecipeError::Magic);
    assert_eq!(refusal(|recipe| recipe[4] ^= 2), RecipeError::Version(3));
    assert_eq!(refusal(|recipe| recipe[13] ^= 1), RecipeError::Checksum);
    for index in [14, RECIPE.len() / 3, RECIPE.len() - 1] {
        assert_eq!(
            refusal(|recipe| recipe[index] ^= 0x10),
            RecipeError::Checksum
        );
    }
}

#[test]
fn a_recipe_cut_short_is_refused_by_name() {
    // Fewer bytes than the header promises, as after a flash that was cut off: the promise grows.
    let found = RECIPE.len() as u32;
    let error = refusal(|recipe| recipe[7] += 1);
    let expected = found + 0x100;
    assert_eq!(error, RecipeError::Length { expected, found });
    // The rest of it as erased flash.
    assert_eq!(
        refusal(|recipe| recipe[100..].fill(0xFF)),
        RecipeError::Checksum
    );
    assert_eq!(refusal(|recipe| recipe.fill(0xFF)), RecipeError::Magic);
}

/// A host that answers each request as told, or not at all, until a request makes it say stop.
fn converse(emulator: &mut Emulator, mut answer: impl FnMut(Request) -> Option<Option<Reply>>) {
    let mut answerer = Answerer::new();
    let mut frame = [0; FRAME_BYTES];
    let mut byte = [0];
    loop {
        emulator.serial.read_exact(&mut byte).unwrap();
        let reply = match answerer.hear(byte[0]) {
            Some(Ok(Heard::New(request))) => match answer(request) {
                Some(reply) => reply,
                None => return,
            },
            Some(Ok(Heard::Again(reply))) => Some(reply),
            _ => None,
        };
        if let Some(reply) = reply {
            let frame = answerer.answer(reply, &mut frame).unwrap();
            emulator.serial.write_all(frame).unwrap();
        }
    }
}

const WELCOME: Reply = Reply::Welcome { protocol: PROTOCOL };

#[test]
fn a_host_of_another_protocol_is_refused_by_name() {
    let mut emulator = boot();
    converse(&mut emulator, |request| match request {
        Request::Failed(failure) => {
            let (device, host) = (PROTOCOL, PROTOCOL + 1);
            assert_eq!(failure, Failure::Protocol { device, host });
            None
        }
        _ => Some(Some(Reply::Welcome {
            protocol: PROTOCOL + 1,
        })),
    });
}

#[test]
fn impossible_measurements_are_taken_again_and_then_given_up_by_name() {
    let mut emulator = boot();
    let mut taken = 0;
    converse(&mut emulator, |request| match request {
        Request::Hello { .. } => Some(Some(WELCOME)),
        Request::Measure { index, .. } => {
            // The first is good, the second bad once, the third bad for ever.
            taken += 1;
            let red = [0.1, f32::NAN, 0.1, -1.0, -1.0, f32::INFINITY][taken - 1];
            Some(Some(Reply::Measured {
                index,
                measurement: Measurement {
                    brdf: [red, 0.1, 0.1],
                    saturated: false,
                },
            }))
        }
        Request::Failed(failure) => {
            let error = MeasurementError::NonFinite(0);
            assert_eq!(failure, Failure::Measurement { index: 2, error });
            None
        }
        other => panic!("{other:?}"),
    });
    assert_eq!(taken, 6);
}

#[test]
fn a_host_that_falls_silent_is_given_up_and_greeted_anew() {
    let mut emulator = boot();
    let begun = Instant::now();
    let mut silent = false;
    converse(&mut emulator, |request| match request {
        Request::Hello { .. } => (!silent).then_some(Some(WELCOME)),
        Request::Measure { index, .. } => Some(Some(Reply::Measured {
            index,
            measurement: Measurement {
                brdf: [0.2; 3],
                saturated: false,
            },
        })),
        // In the middle of the fit.
        _ => {
            silent = true;
            Some(None)
        }
    });
    assert!(begun.elapsed() < Duration::from_secs(45));
    let _ = emulator.wait_for("NoReply");
    let material = unseen(1);
    let report = VirtualScanner::new(&material, Options::default())
        .serve(&mut emulator.serial)
        .unwrap();
    assert_agrees(&report);
}

/// Bounds checks, `unwrap`, slicing and their like all call functions of `core::panicking`.
#[test]
fn nothing_in_the_firmware_can_panic() {
    let mut symbols = Firmware::load().symbols();
    assert!(
        symbols.iter().any(|name| name == "main"),
        "the symbols are stripped"
    );
    // defmt brings a way to panic of its own. Some linkers keep it, though nothing calls it.
    let defmt = symbols.iter().any(|name| name == "__defmt_default_panic");
    symbols.retain(|name| name.contains("panicking") || name.contains("_failed"));
    if defmt {
        symbols.retain(|name| !name.contains("9panic_fmt") && !name.contains("panicking5panic"));
    }
    assert!(symbols.is_empty(), "{symbols:#?}");
}
