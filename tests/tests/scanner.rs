//! The virtual scanner in front of a device that is played on the host.

use std::net::{TcpListener, TcpStream};
use std::thread;
use std::time::Duration;

use glimpse_core::angles::{Directions, HalfDifference};
use glimpse_core::link::{Failure, PROTOCOL, Refusal, Reply, Request};
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{Recipe, RecipeError};
use glimpse_tests::RECIPE;
use glimpse_tests::device::{Device, fit};
use glimpse_tests::line::BadLine;
use glimpse_trainer::material::{Material, Procedural};
use glimpse_trainer::sampling::uniform_valid;
use glimpse_trainer::scanner::{Options, ScannerError, VirtualScanner, angles_of};

const PATIENCE: Duration = Duration::from_millis(30);

/// Both ends of a line.
fn line() -> (TcpStream, TcpStream) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let device = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
    let (host, _) = listener.accept().unwrap();
    host.set_nodelay(true).unwrap();
    host.set_read_timeout(Some(Duration::from_secs(30)))
        .unwrap();
    (device, host)
}

/// A material that recipes are not trained on.
fn material() -> Procedural {
    Procedural::new(0, 0xFEED)
}

fn hello(protocol: u16) -> Request {
    Request::Hello {
        protocol,
        model: ModelKind::Neural,
        samples: 8,
        recipe: 0,
    }
}

#[test]
fn angles_survive_the_way_through_directions() {
    for angles in uniform_valid(1000, 1) {
        let at = HalfDifference::from_angles(angles);
        let back = HalfDifference::from_angles(angles_of(&at.directions()).unwrap());
        for (a, b) in [
            (at.hx, back.hx),
            (at.hz, back.hz),
            (at.dx, back.dx),
            (at.dy, back.dy),
            (at.dz, back.dz),
        ] {
            assert!((a - b).abs() < 1e-5, "{angles:?}: {at:?} {back:?}");
        }
    }
}

#[test]
fn a_device_gets_what_the_material_is_and_the_host_what_was_fitted() {
    let (device, mut host) = line();
    let device = thread::spawn(move || Device::new(device, PATIENCE)?.scan(RECIPE));
    let material = material();
    let report = VirtualScanner::new(&material, Options::default())
        .serve(&mut host)
        .unwrap();
    device.join().unwrap().unwrap();

    assert_eq!(report.recipe, Recipe::parse(RECIPE).unwrap().checksum());
    for taken in &report.measurements {
        assert_eq!(taken.measurement.brdf, material.brdf(taken.angles));
    }
    let (parameters, residual) = fit(RECIPE, &report.measurements);
    assert_eq!(report.parameters, parameters);
    assert_eq!(report.residual, residual);
    assert!(report.loss(&material, 0).is_finite());
}

#[test]
fn a_bad_line_changes_nothing() {
    let (device, host) = line();
    let device = thread::spawn(move || Device::new(device, PATIENCE)?.scan(RECIPE));
    let material = material();
    let mut host = BadLine::new(host, 0.003, 1);
    let report = VirtualScanner::new(&material, Options::default())
        .serve(&mut host)
        .unwrap();
    assert!(host.spoiled > 0);
    let (parameters, residual) = fit(RECIPE, &report.measurements);
    assert_eq!(report.parameters, parameters);
    assert_eq!(report.residual, residual);
    // The last word of the host may have been spoiled: then nobody answers the device any more.
    drop(host);
    let _ = device.join().unwrap();
}

#[test]
fn noise_is_the_same_for_the_same_seed() {
    let scan = |seed| {
        let (device, mut host) = line();
        let device = thread::spawn(move || Device::new(device, PATIENCE)?.scan(RECIPE));
        let options = Options { noise: 0.1, seed };
        let material = material();
        let report = VirtualScanner::new(&material, options)
            .serve(&mut host)
            .unwrap();
        device.join().unwrap().unwrap();
        report
            .measurements
            .iter()
            .map(|taken| taken.measurement.brdf)
            .collect::<Vec<_>>()
    };
    let (first, again, other) = (scan(1), scan(1), scan(2));
    assert_eq!(first, again);
    assert!(first.iter().zip(&other).all(|(a, b)| a != b));
}

#[test]
fn what_cannot_be_met_is_refused_by_name() {
    let (device, mut host) = line();
    let host = thread::spawn(move || {
        let material = material();
        VirtualScanner::new(&material, Options::default()).serve(&mut host)
    });
    let mut device = Device::new(device, PATIENCE).unwrap();
    let directions = Directions {
        incoming: [0.0, 0.0, 1.0],
        outgoing: [0.0, 0.0, 1.0],
    };
    let measure = Request::Measure {
        index: 0,
        directions,
    };
    assert_eq!(
        device.ask(&measure).unwrap(),
        Reply::Refused(Refusal::NoScan)
    );
    device.ask(&hello(PROTOCOL)).unwrap();
    assert!(matches!(
        device.ask(&measure).unwrap(),
        Reply::Measured { .. }
    ));
    let below = Request::Measure {
        index: 1,
        directions: Directions {
            incoming: [1.0, 0.0, -0.1],
            outgoing: [0.0, 0.0, 1.0],
        },
    };
    assert_eq!(
        device.ask(&below).unwrap(),
        Reply::Refused(Refusal::Directions)
    );
    let beyond = Request::Parameters {
        offset: 1,
        values: heapless::Vec::new(),
    };
    assert_eq!(
        device.ask(&beyond).unwrap(),
        Reply::Refused(Refusal::Parameters)
    );

    let failure = Failure::Recipe(RecipeError::Checksum);
    device.ask(&Request::Failed(failure)).unwrap();
    let error = host.join().unwrap().unwrap_err();
    assert!(matches!(error, ScannerError::Device(named) if named == failure));
}

#[test]
fn another_protocol_is_refused_by_name() {
    let (device, mut host) = line();
    let host = thread::spawn(move || {
        let material = material();
        VirtualScanner::new(&material, Options::default()).serve(&mut host)
    });
    let mut device = Device::new(device, PATIENCE).unwrap();
    let welcome = Reply::Welcome { protocol: PROTOCOL };
    assert_eq!(device.ask(&hello(PROTOCOL + 1)).unwrap(), welcome);
    let error = host.join().unwrap().unwrap_err();
    assert!(matches!(error, ScannerError::Protocol(version) if version == PROTOCOL + 1));
}
