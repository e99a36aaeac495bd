//! Defects of version 0.3's driver. Each test failed with it. `histories.rs` compares more states with a model.

use std::cell::Cell;

use glimpse_core::driver::{Action, Config, Driver, Host};
use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::gonio::Reading;
use glimpse_core::link::{PROTOCOL, Reply, Request};
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::EvidenceLimits;

use super::bench::*;
use crate::recipes::{SMALL, random_recipe};
use crate::scanning::*;

const HOUR_MS: u64 = 3_600_000;

/// A recipe that tolerates missing readings and bounds the loss of the first ones.
fn tolerant_recipe() -> Recipe<'static> {
    random_recipe(SMALL, None).predicted().recipe()
}

/// Defect 1: A silence, a refusal, a restart or another version of the host made the device forget its own readings and
/// move again. Now the host is asked about them after the firmware continues.
#[test]
fn nothing_moves_after_failure_of_host() {
    type When = fn(&Request) -> bool;
    let hello: When = |request| matches!(request, Request::Hello { .. });
    let measure: When = |request| matches!(request, Request::Measure { index: 5, .. });
    let progress: When = |request| matches!(request, Request::Progress(_));
    let (device, host) = (PROTOCOL, PROTOCOL + 1);
    let welcome = Reply::Welcome { protocol: host };
    let protocol = Error::with(ErrorCode::Protocol, [device.into(), host.into()]);
    let codes = [ErrorCode::RefusedModel, ErrorCode::RefusedNoScan];
    let [model, no_scan] = codes.map(|code| Error::with(code, [code.number().into(), 0]));
    let [not_model, not_scan] = codes.map(Reply::Refused);
    let missing = Error::with(ErrorCode::ReadingRequired, [5, 0]);
    let either = &[Host::Measures, Host::Listens][..];
    let cases = [
        (measure, None, Error::new(ErrorCode::NoReply), &either[..1]),
        (hello, Some(welcome), protocol, either),
        (hello, Some(not_model.clone()), model, either),
        (measure, Some(not_scan.clone()), no_scan, &either[..1]),
        (
            measure,
            Some(Reply::Skip { index: 5 }),
            missing,
            &either[..1],
        ),
        (progress, Some(not_model), model, either),
        (progress, Some(not_scan), no_scan, &either[..1]),
    ];
    for (when, wrong, failure, hosts) in cases {
        for host in hosts {
            let healed = Cell::new(false);
            let mut bench = Bench::new(|request| match when(request) && !healed.get() {
                true => wrong.clone(),
                false => Some(default_reply(request)),
            });
            let mut scan = new_scan(recipe_for(ModelKind::Phong));
            record(&mut scan, [0, 1], synthetic_reading); // from before a reset
            let mut driver: AnyDriver = Driver::new(scan, Config::new(*host));
            let (at, _) = bench.run(&mut driver, is_failed);
            assert!(wrong.is_some() || at == 60_000, "{at}");
            healed.set(true);
            let read = SAMPLES - driver.scan().pending().count();
            assert!(read >= 2);
            assert_eq!(bench.actions.last().unwrap().1, Action::Failed(failure));
            bench.take_actions();
            bench.requests.clear();
            // At most a report is sent. `histories.rs` checks that nothing moves and nothing is forgotten.
            bench.wait(&mut driver, 24 * HOUR_MS);
            assert_eq!(bench.take_actions(), []);
            let is_report = |request: &Request| *request == Request::Failed(failure);
            assert!(bench.requests.len() <= 1 && bench.requests.iter().all(is_report));
            bench.requests.clear();
            driver.resume();
            bench.run(&mut driver, is_finished);
            let offered = bench.count(|request| matches!(request, Request::Restored { .. }));
            let expected = if *host == Host::Measures { read } else { 0 };
            assert_eq!(offered, expected);
        }
    }
}

/// A skip survives a reset, so that a wrong reading does not come back.
#[test]
fn skip_is_saved() {
    let mut driver = new_driver(tolerant_recipe(), Config::new(Host::Absent));
    let mut bench = Bench::cooperative();
    while driver.scan().reading(3).is_none() {
        bench.step(&mut driver);
    }
    driver.skip(3).unwrap();
    bench.run(&mut driver, is_finished);
    let reading = None;
    assert!(
        bench
            .take_actions()
            .contains(&Action::Save { index: 3, reading })
    );
}

/// The cause of a wrong result is stated with it.
#[test]
fn result_states_room_light_drift_saturation_and_old_readings() {
    let result = |prepare: fn(&mut Bench<'_>), restored: &[u16], limits| {
        let mut scan = new_scan(recipe_for(ModelKind::Phong));
        record(&mut scan, restored.iter().copied(), synthetic_reading);
        let mut config = Config::new(Host::Absent);
        config.limits = limits;
        let mut driver: AnyDriver = Driver::new(scan, config);
        let mut bench = Bench::cooperative();
        prepare(&mut bench);
        match bench.run(&mut driver, is_finished).1 {
            Action::Finished(residual) => residual,
            other => panic!("{other:?}"),
        }
    };
    let good: fn(&mut Bench<'_>) = |_| ();
    let lit: fn(&mut Bench<'_>) = |bench| bench.dark = 0.03;
    let drifting: fn(&mut Bench<'_>) = |bench| {
        let mut brightness = 1.0;
        bench.sensor = Box::new(move |index| {
            brightness *= 0.99;
            let reading = synthetic_reading(index);
            Reading::new(reading.brdf.map(|brdf| brightness * brdf))
        });
    };
    let saturated: fn(&mut Bench<'_>) = |bench| {
        bench.sensor = Box::new(|index| Reading {
            saturated: index > 4,
            ..synthetic_reading(index)
        });
    };
    let (all, none) = (EvidenceLimits::DEFAULT, EvidenceLimits::NONE);
    for (prepare, restored, cause) in [
        (good, &[][..], None),
        (good, &[0, 1, 2], None),
        (lit, &[], Some(ErrorCode::RoomLight)),
        (drifting, &[], Some(ErrorCode::Drift)),
        (saturated, &[], Some(ErrorCode::Saturated)),
        (good, &[0, 1, 2, 3, 4, 5, 6, 7], Some(ErrorCode::Restored)),
    ] {
        let residual = result(prepare, restored, all);
        assert_eq!(residual.implausible, cause, "{residual:?}");
        assert_eq!(usize::from(residual.evidence.restored), restored.len());
        let unlimited = result(prepare, restored, none).implausible;
        assert_eq!(unlimited, cause.filter(|code| *code == ErrorCode::Restored));
    }
    let drift = result(drifting, &[], all).evidence.drift.unwrap();
    let expected = 1.0 - 0.99_f32.powi(8); // eight readings after the first one
    assert!((drift - expected).abs() < 1e-5, "{drift}");
}

/// Defect 1: A host that appears after a failure receives its report.
#[test]
fn late_host_receives_failure() {
    for host in [Host::Measures, Host::Listens] {
        let mut driver = phong_driver(Config::new(host));
        let mut bench = Bench::cooperative();
        bench.disconnected = true;
        driver.fail(Error::new(ErrorCode::Machine));
        bench.wait(&mut driver, HOUR_MS);
        assert!(bench.frames.len() < 4_000, "{}", bench.frames.len());
        bench.disconnected = false;
        bench.wait(&mut driver, 33_000);
        let report = Request::Failed(Error::new(ErrorCode::Machine));
        assert_eq!(bench.requests, [report]);
        // The arms' failure does not delay their operator.
        bench.sensor = Box::new(synthetic_reading);
        let start = bench.now;
        bench.sleep_ms = 0;
        driver.resume();
        let (end, _) = bench.run(&mut driver, is_forget);
        assert_eq!(end, start);
    }
}

/// A result that the host has accepted is not sent again.
#[test]
fn published_result_stays_published() {
    let mut driver = phong_driver(Config::new(Host::Listens));
    let mut bench = Bench::cooperative();
    bench.run(&mut driver, is_forget);
    // The firmware continues before its report of a failure is sent, or before the reply arrives.
    for steps in 0..4 {
        driver.fail(Error::new(ErrorCode::Machine));
        bench.sleep_ms = 0;
        for _ in 0..steps {
            bench.step(&mut driver);
        }
        driver.resume();
        bench.sleep_ms = 0;
        bench.wait(&mut driver, HOUR_MS);
        assert_eq!(bench.results().1, 1);
    }
}

/// Defect 2: A host that refused each `Hello` caused 7,115 `Forget` actions an hour.
#[test]
fn refusing_host_wears_out_no_flash() {
    for restarts in [false, true] {
        for host in [Host::Measures, Host::Listens] {
            let mut driver = phong_driver(Config::new(host));
            let mut bench = Bench::new(|request| match request {
                Request::Hello { .. } => Some(Reply::Refused(ErrorCode::RefusedModel)),
                _ => Some(default_reply(request)),
            });
            while bench.now < HOUR_MS {
                bench.run(&mut driver, is_failed);
                match restarts {
                    true => driver.restart(),
                    false => driver.resume(),
                }
            }
            assert!(!bench.actions.iter().any(|(_, action)| is_forget(action)));
            // Pauses of 0.5 s, 1 s, 2 s, ... and of 30 s at most.
            let hellos = bench.count(|request| matches!(request, Request::Hello { .. }));
            assert!((100..140).contains(&hellos), "{hellos}");
        }
    }
}

/// Defect 4: `Hello` had no timeout: without its host, a device that moves its own arms never scanned.
#[test]
fn listening_host_is_optional() {
    let mut driver = phong_driver(Config::new(Host::Listens));
    let mut bench = Bench::cooperative();
    bench.disconnected = true;
    let (at, _) = bench.run(&mut driver, is_finished);
    assert_eq!(at, 2_000);
    bench.wait(&mut driver, 24 * HOUR_MS);
    assert!(
        !bench
            .actions
            .iter()
            .any(|(_, action)| is_forget(action) || is_failed(action))
    );
    // Bursts of 20 frames between pauses of 30 s.
    let frames = bench.frames.len();
    assert!((50_000..60_000).contains(&frames), "{frames}");
    // Somebody listens.
    bench.disconnected = false;
    let start = bench.now;
    let (at, _) = bench.run(&mut driver, is_forget);
    assert!(at <= start + 30_000);
    let expected = full_scan(recipe_for(ModelKind::Phong), synthetic_reading);
    assert_eq!(bench.results(), (expected.bits().to_vec(), 1));
    assert_eq!(fitted_bits(&driver), expected.bits());
}

/// Defect 8: A target ended a scan whose bound did not hold. `histories.rs` has readings out of order, and samples without
/// one: a target must not end those scans.
#[test]
fn target_ends_scan_at_its_bound() {
    let reading = |index| Reading {
        saturated: false,
        ..synthetic_reading(index)
    };
    let readings_until_stop = |target: f32| {
        let mut config = Config::new(Host::Absent);
        config.target_loss = Some(target);
        let mut driver = new_driver(tolerant_recipe(), config);
        let mut bench = Bench::cooperative();
        bench.sensor = Box::new(reading);
        bench.run(&mut driver, is_finished);
        let scan = driver.scan();
        (0..6)
            .take_while(|index| scan.reading(*index).is_some())
            .count()
    };
    // The bound after each number of readings, by separate fits.
    let bounds: Vec<f32> = (1..=6)
        .map(|count| {
            let mut scan = new_scan(tolerant_recipe());
            record(&mut scan, 0..count, reading);
            fit(&mut scan, &[u32::MAX]);
            scan.fitted().unwrap().loss_bound().unwrap()
        })
        .collect();
    for target in bounds.iter().chain(&[f32::MAX]) {
        let first = bounds.iter().position(|bound| bound <= target).unwrap();
        assert_eq!(readings_until_stop(*target), first + 1);
    }
    for target in [f32::NAN, -1.0, 0.0] {
        assert_eq!(readings_until_stop(target), 6);
    }
}
