//! The virtual scanner with a device that is simulated on the host.

use std::io;
use std::net::{TcpListener, TcpStream};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use glimpse_core::driver::Host;
use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::geometry::{Directions, HalfDifference};
use glimpse_core::link::{PROTOCOL, Purpose, Reply, Request};
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Evidence;
use glimpse_fitting::recipe::ReadingNoise;
use glimpse_fitting::scanner::{ScannerError, VirtualScanner, angles_of};
use glimpse_materials::sampling::uniform_valid;
use glimpse_materials::{Brdf, FittedMaterial, Material};
use glimpse_tests::RECIPE;
use glimpse_tests::device::{Device, OWN_READING, assert_matches_host};
use glimpse_tests::host::{noiseless_scanner, unseen_material};

const REPLY_TIMEOUT: Duration = Duration::from_millis(30);

/// Starts a device that scans with [`RECIPE`]. Returns its thread and the host's end of the line.
fn start_device(host: Host) -> (JoinHandle<io::Result<()>>, TcpStream) {
    let (device, line) = line();
    let scan = move || Device::new(device, REPLY_TIMEOUT)?.scan(RECIPE, host);
    (thread::spawn(scan), line)
}

/// Returns both ends of a line: device and host.
fn line() -> (TcpStream, TcpStream) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let device = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
    let (host, _) = listener.accept().unwrap();
    host.set_nodelay(true).unwrap();
    host.set_read_timeout(Some(Duration::from_secs(30)))
        .unwrap();
    (device, host)
}

fn hello(recipe: u32) -> Request {
    Request::Hello {
        protocol: PROTOCOL,
        model: ModelKind::Neural,
        samples: 8,
        recipe,
    }
}

/// A request to read sample 0.
fn measure(incoming: [f32; 3]) -> Request {
    let outgoing = [0.6, 0.0, 0.8];
    Request::Measure {
        purpose: Purpose::Sample,
        index: 0,
        directions: Directions { incoming, outgoing },
    }
}

#[test]
fn conversion_to_directions_keeps_angles() {
    for angles in uniform_valid(1000, 1) {
        let original = HalfDifference::from_angles(angles);
        let converted = HalfDifference::from_angles(angles_of(&original.directions()).unwrap());
        for (a, b) in original.to_array().into_iter().zip(converted.to_array()) {
            assert!(
                (a - b).abs() < 1e-5,
                "{angles:?}: {original:?} {converted:?}"
            );
        }
    }
}

#[test]
fn device_receives_brdf_and_host_receives_fit() {
    let (device, mut host) = start_device(Host::Measures);
    let material = unseen_material(0);
    let report = noiseless_scanner(&material).serve(&mut host).unwrap();
    device.join().unwrap().unwrap();

    // A scanner without noise does not drift.
    let Evidence { dark, drift, .. } = report.residual.evidence;
    assert_eq!((dark, drift), (Some(0.0), Some(0.0)));
    assert_matches_host(&report, RECIPE);
    for reading in &report.readings {
        assert_eq!(reading.reading.brdf, material.at_angles(reading.angles));
    }
    let loss = report.loss(None, &material).unwrap();
    assert!(loss.is_finite());

    // The material's file is a source of materials.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scan.json");
    let files = report.material_files(&path, "scan", None, Some(loss));
    let [(path, json)] = &files.unwrap()[..] else {
        panic!("not one file");
    };
    std::fs::write(path, json).unwrap();
    let read = FittedMaterial::read(path).unwrap();
    assert_eq!(
        (read.name(), read.fitted().values()),
        ("scan", &report.values[..])
    );
}

#[test]
fn listener_receives_the_fit_of_a_device_that_measures() {
    let (device, mut host) = start_device(Host::Listens);
    let mut scanner = VirtualScanner::new(None, ReadingNoise::default(), 0);
    let report = scanner.serve(&mut host).unwrap();
    device.join().unwrap().unwrap();
    assert!(report.readings.is_empty());
    let fitted = report.fitted(None).unwrap();
    for angles in Recipe::parse(RECIPE).unwrap().pattern() {
        let brdf = fitted.at_angles(angles);
        let errors = brdf.iter().zip(OWN_READING);
        assert!(
            errors.clone().all(|(f, own)| (f / own - 1.0).abs() < 0.3),
            "{brdf:?}"
        );
    }
}

#[test]
fn refuses_invalid_requests() {
    let (device, mut host) = line();
    let host = thread::spawn(move || {
        let material = unseen_material(0);
        noiseless_scanner(&material).serve(&mut host)
    });
    let mut device = Device::new(device, REPLY_TIMEOUT).unwrap();
    let above = measure([0.0, 0.0, 1.0]);
    let reply = device.request(&above).unwrap();
    assert_eq!(reply, Reply::Refused(ErrorCode::RefusedNoScan));
    device.request(&hello(0)).unwrap();
    let reply = device.request(&above).unwrap();
    assert!(matches!(reply, Reply::Measured { .. }));
    let below = measure([1.0, 0.0, -0.1]);
    let values_from_offset_1 = Request::Values {
        offset: 1,
        total: 675,
        values: Default::default(),
    };
    for (request, refusal) in [
        (below, ErrorCode::RefusedDirections),
        (values_from_offset_1, ErrorCode::RefusedValues),
    ] {
        assert_eq!(device.request(&request).unwrap(), Reply::Refused(refusal));
    }

    let failure = Error::new(ErrorCode::RecipeChecksum);
    device.request(&Request::Failed(failure)).unwrap();
    let error = host.join().unwrap().unwrap_err();
    assert!(matches!(error, ScannerError::Device(report) if report == failure));
}

/// After a reset, a device offers its saved readings.
#[test]
fn saved_readings_are_accepted_only_if_unchanged() {
    let material = unseen_material(0);
    let mut scanner = noiseless_scanner(&material);
    let (device, mut host) = line();
    let device = thread::spawn(move || {
        let mut device = Device::new(device, REPLY_TIMEOUT).unwrap();
        let saved = |index, reading| Request::Restored { index, reading };
        let refused = Reply::Refused(ErrorCode::RefusedRestored);
        device.request(&hello(0)).unwrap();
        let reply = device.request(&measure([0.0, 0.0, 1.0])).unwrap();
        let Reply::Measured { reading, .. } = reply else {
            panic!("{reply:?}")
        };
        // Without a hello in between, there was no reset.
        assert_eq!(device.request(&saved(0, reading)).unwrap(), refused);
        device.request(&hello(0)).unwrap();
        let (mut brighter, mut saturated) = (reading, reading);
        brighter.brdf[1] += 0.1;
        saturated.saturated = true;
        for request in [saved(0, brighter), saved(0, saturated), saved(1, reading)] {
            assert_eq!(device.request(&request).unwrap(), refused);
        }
        assert_eq!(device.request(&saved(0, reading)).unwrap(), Reply::Accepted);
        // After a second reset, the reading is accepted again. With another recipe, it is refused.
        device.request(&hello(0)).unwrap();
        assert_eq!(device.request(&saved(0, reading)).unwrap(), Reply::Accepted);
        device.request(&hello(1)).unwrap();
        assert_eq!(device.request(&saved(0, reading)).unwrap(), refused);
    });
    // The device closes the line.
    assert!(scanner.serve(&mut host).is_err());
    device.join().unwrap();
}
