//! The virtual scanner in front of a device that is played on the host.

use std::net::{TcpListener, TcpStream};
use std::thread;
use std::time::Duration;

use glimpse_core::geometry::{Directions, HalfDifference};
use glimpse_core::link::{Failure, FailureReport, PROTOCOL, Refusal, Reply, Request};
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{Recipe, RecipeError};
use glimpse_materials::sampling::uniform_valid;
use glimpse_materials::{Material, Procedural};
use glimpse_tests::RECIPE;
use glimpse_tests::device::{Device, fit};
use glimpse_tests::host::{scanner, unseen};
use glimpse_tests::line::{BadLine, Fault};
use glimpse_trainer::scanner::{ScanReport, ScannerError, ScannerNoise, VirtualScanner, angles_of};

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

fn material() -> Procedural {
    unseen(0)
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
    let report = scanner(&material).serve(&mut host).unwrap();
    device.join().unwrap().unwrap();

    assert_eq!(report.recipe, Recipe::parse(RECIPE).unwrap().checksum());
    assert_right(&report);
    assert!(report.loss(None, &material).unwrap().is_finite());
}

#[test]
fn a_bad_line_changes_nothing() {
    let (device, host) = line();
    let device = thread::spawn(move || Device::new(device, PATIENCE)?.scan(RECIPE));
    let material = material();
    let mut host = BadLine::new(host, 0.003, 1);
    let report = scanner(&material).serve(&mut host).unwrap();
    assert!(host.spoiled > 0);
    assert_right(&report);
    // The last word of the host may have been spoiled: then nobody answers the device any more.
    drop(host);
    let _ = device.join().unwrap();
}

/// The scan over a line with one fault, and how many bytes were spoiled.
fn scan_over(fault: Fault, rate: f64) -> (Result<ScanReport, ScannerError>, usize) {
    let (device, host) = line();
    let device = thread::spawn(move || Device::new(device, PATIENCE)?.scan(RECIPE));
    let material = material();
    let mut host = BadLine::with(host, &[fault], rate, 1);
    let result = scanner(&material).serve(&mut host);
    let spoiled = host.spoiled;
    drop(host);
    let _ = device.join().unwrap(); // as above
    (result, spoiled)
}

/// With one byte in a hundred spoiled, the scan is whole and right. With one in ten, it is, or the device gives
/// up and hangs up.
fn check_fault(fault: Fault) {
    for rate in [0.01, 0.1] {
        let (result, spoiled) = scan_over(fault, rate);
        assert!(spoiled > 0);
        match result {
            Ok(report) => assert_right(&report),
            Err(ScannerError::Closed | ScannerError::Link(_)) if rate == 0.1 => {}
            Err(other) => panic!("{rate}: {other}"),
        }
    }
}

fn assert_right(report: &ScanReport) {
    let (values, residual) = fit(RECIPE, &report.readings);
    assert_eq!(report.values, values);
    assert_eq!(report.residual, residual);
    for taken in &report.readings {
        assert_eq!(taken.reading.brdf, material().brdf(taken.angles));
    }
}

#[test]
fn bytes_lost() {
    check_fault(Fault::Lost);
}

#[test]
fn bytes_altered() {
    check_fault(Fault::Altered);
}

#[test]
fn bytes_doubled() {
    check_fault(Fault::Doubled);
}

#[test]
fn bytes_swapped() {
    check_fault(Fault::Swapped);
}

#[test]
fn frames_cut() {
    check_fault(Fault::Cut);
}

#[test]
fn noise_is_the_same_for_the_same_seed() {
    let scan = |seed| {
        let (device, mut host) = line();
        let device = thread::spawn(move || Device::new(device, PATIENCE)?.scan(RECIPE));
        let noise = ScannerNoise {
            deviation: 0.1,
            seed,
        };
        let material = material();
        let report = VirtualScanner::new(&material, noise)
            .serve(&mut host)
            .unwrap();
        device.join().unwrap().unwrap();
        report
            .readings
            .iter()
            .map(|taken| taken.reading.brdf)
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
        scanner(&material).serve(&mut host)
    });
    let mut device = Device::new(device, PATIENCE).unwrap();
    let measure = |incoming| Request::Measure {
        index: 0,
        directions: Directions {
            incoming,
            outgoing: [0.0, 0.0, 1.0],
        },
    };
    let above = measure([0.0, 0.0, 1.0]);
    let no_scan = device.request(&above).unwrap();
    assert_eq!(no_scan, Reply::Refused(Refusal::NoScan));
    device.request(&hello(PROTOCOL)).unwrap();
    let reply = device.request(&above).unwrap();
    assert!(matches!(reply, Reply::Measured { .. }));
    let below = measure([1.0, 0.0, -0.1]);
    let beyond = Request::Values {
        offset: 1,
        total: 675,
        values: Default::default(),
    };
    for (request, refusal) in [(below, Refusal::Directions), (beyond, Refusal::Values)] {
        assert_eq!(device.request(&request).unwrap(), Reply::Refused(refusal));
    }

    let failure = FailureReport::from(Failure::Recipe(RecipeError::Checksum));
    device.request(&Request::Failed(failure)).unwrap();
    let error = host.join().unwrap().unwrap_err();
    assert!(matches!(error, ScannerError::Device(named) if named == failure));
}

/// A device that was reset asks whether its measurements hold still.
#[test]
fn kept_measurements_hold_only_where_they_were_given() {
    let material = material();
    let mut scanner = scanner(&material);
    let (device, mut host) = line();
    let device = thread::spawn(move || {
        let mut device = Device::new(device, PATIENCE).unwrap();
        let directions = Directions {
            incoming: [0.0, 0.0, 1.0],
            outgoing: [0.6, 0.0, 0.8],
        };
        let index = 0;
        let kept = |reading| Request::Saved { index, reading };
        let refused = Reply::Refused(Refusal::Saved);
        device.request(&hello(PROTOCOL)).unwrap();
        let reply = device
            .request(&Request::Measure { index, directions })
            .unwrap();
        let Reply::Measured { reading, .. } = reply else {
            panic!("{reply:?}")
        };
        // Without a hello between there was no reset.
        assert_eq!(device.request(&kept(reading)).unwrap(), refused);
        device.request(&hello(PROTOCOL)).unwrap();
        let mut altered = reading;
        altered.brdf[1] += 0.1;
        assert_eq!(device.request(&kept(altered)).unwrap(), refused);
        altered = reading;
        altered.saturated = true;
        assert_eq!(device.request(&kept(altered)).unwrap(), refused);
        let other = Request::Saved { index: 1, reading };
        assert_eq!(device.request(&other).unwrap(), refused);
        assert_eq!(device.request(&kept(reading)).unwrap(), Reply::Accepted);
        // Reset twice it holds as well; by another recipe it does not.
        device.request(&hello(PROTOCOL)).unwrap();
        assert_eq!(device.request(&kept(reading)).unwrap(), Reply::Accepted);
        let another = Request::Hello {
            protocol: PROTOCOL,
            model: ModelKind::Neural,
            samples: 8,
            recipe: 1,
        };
        device.request(&another).unwrap();
        assert_eq!(device.request(&kept(reading)).unwrap(), refused);
    });
    // The device hangs up.
    assert!(scanner.serve(&mut host).is_err());
    device.join().unwrap();
}

#[test]
fn another_protocol_is_refused_by_name() {
    let (device, mut host) = line();
    let host = thread::spawn(move || {
        let material = material();
        scanner(&material).serve(&mut host)
    });
    let mut device = Device::new(device, PATIENCE).unwrap();
    let welcome = Reply::Welcome { protocol: PROTOCOL };
    assert_eq!(device.request(&hello(PROTOCOL + 1)).unwrap(), welcome);
    let error = host.join().unwrap().unwrap_err();
    assert!(matches!(error, ScannerError::Protocol(version) if version == PROTOCOL + 1));
}
