//! Scans over stops, restarts, calibrations, and the order of readings.

use std::cell::Cell;

use embassy_time::Instant;
use glimpse_core::driver::Host;
use glimpse_core::error::ErrorCode;
use glimpse_core::geometry::Arms;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::EvidenceLimits;
use glimpse_desk::optics::{SensorFault, ggx, plastic, tile};
use glimpse_desk::{Desk, Line, Random, SECTOR_BYTES, Wiring, separation};
use glimpse_scanner::Command;

use crate::faults::{N8, N16};

static N32: &[u8] = include_bytes!("../../../../trainer/recipes/completed/neural-n32.recipe");
static TIMED: &[u8] = include_bytes!("../../../../trainer/recipes/timed/neural-n16.recipe");
static MASKED: &[u8] = include_bytes!("../../../../trainer/recipes/masked/neural-n16.recipe");

/// The readings of a scan of n samples: with the lamp off twice, and the first sample again.
const CHECKS: usize = 3;

/// Returns the numbers in the texts "reading k of n" since the start.
fn samples(desk: &Desk) -> usize {
    let texts = desk.texts.borrow();
    texts
        .iter()
        .filter(|text| text.starts_with("reading"))
        .count()
}

/// A reading that fails, a stop at any time, and one in the last homing cost no reading that was made before.
#[test]
fn stops_cost_no_readings() {
    let desk = Desk::new(N16);
    desk.sensor.set(SensorFault::NackAt(12));
    desk.patience.set(9);
    desk.scan();
    assert_eq!(samples(&desk), 16);
    assert_eq!(desk.failures.borrow()[0].code, ErrorCode::Sensor);
    drop(desk);

    let desk = Desk::new(N16);
    desk.patience.set(9);
    let is_stopped = Cell::new(false);
    desk.run(Host::Listens, || {
        let is_home = desk
            .texts
            .borrow()
            .iter()
            .filter(|text| *text == "homing")
            .count()
            == 2;
        if is_home && !is_stopped.replace(true) {
            desk.commands.borrow_mut().push_back((0, Command::Stop));
        }
        desk.is_over(1)
    });
    assert_eq!(desk.failures.borrow()[0].code, ErrorCode::Stopped);
    assert_eq!((samples(&desk), desk.results.borrow().len()), (16, 1));
}

/// A restart while the arms rest costs no reading.
#[test]
fn restarts_cost_no_readings() {
    for count in [2, 9, 16] {
        let desk = Desk::new(N16);
        let rest = Cell::new((desk.machine.positions(), 0));
        desk.run(Host::Listens, || {
            let (now, (positions, since)) = (Instant::now().as_millis(), rest.get());
            if positions != desk.machine.positions() || samples(&desk) < count {
                rest.set((desk.machine.positions(), now));
            }
            now - since > 100 && samples(&desk) == count
        });
        desk.scan();
        assert_eq!(samples(&desk), 16, "{count} {:?}", desk.texts.borrow());
        assert!(desk.failures.borrow().is_empty());
        let restored = desk.results.borrow()[0].0.evidence.restored;
        assert_eq!(usize::from(restored), count);
        assert!(desk.error() < 0.1);
    }
}

/// A complete scan from before a restart is offered as that. If it is shown, the host receives that it is old.
#[test]
fn old_scan_is_never_new() {
    let desk = Desk::new(N8);
    desk.scan();
    desk.light.put(tile);
    desk.line.set(Line::Host);
    desk.run(Host::Listens, || desk.host.borrow().finished.len() == 1);
    assert!(
        desk.texts
            .borrow()
            .iter()
            .any(|text| text.starts_with("a complete scan is saved"))
    );
    let old = desk.host.borrow().finished[0];
    assert_eq!(
        (old.implausible, old.evidence.restored),
        (Some(ErrorCode::Restored), 8)
    );
    // The next press scans the next material.
    desk.commands.borrow_mut().push_back((0, Command::Restart));
    desk.patience.set(2);
    let readings = desk.readings.get();
    desk.run(Host::Listens, || desk.host.borrow().finished.len() == 2);
    assert!(desk.readings.get() >= readings + 8 + CHECKS);
    assert_eq!(desk.host.borrow().finished[1].implausible, None);
}

/// A host that refuses progress does not cost the readings. It prints what failed, with axis and steps.
#[test]
fn host_receives_words_and_numbers() {
    let desk = Desk::new(N8);
    desk.line.set(Line::Host);
    desk.host.borrow_mut().refuses_progress = true;
    desk.patience.set(2);
    desk.run(Host::Listens, || desk.failures.borrow().len() == 2);
    assert_eq!(samples(&desk), 8);
    drop(desk);

    let desk = Desk::new(N8);
    desk.line.set(Line::Host);
    desk.stalls.set(Some((4, 3, 64)));
    desk.run(Host::Listens, || !desk.host.borrow().failures.is_empty());
    let shown = desk.failures.borrow()[0];
    assert_eq!((shown.code, shown.details[0]), (ErrorCode::LostSteps, 3));
    assert_eq!(desk.host.borrow().failures[0], shown.to_string());
}

/// After any failure or stop, homing keeps lamp and sensor apart.
#[test]
fn homing_keeps_lamp_and_sensor_apart() {
    let closest = |desk: &Desk| {
        let closest = Cell::new(9.0_f32);
        desk.run(Host::Absent, || {
            if samples(desk) > 0 {
                closest.set(closest.get().min(separation(desk.machine.angles())));
            }
            let homings = desk
                .texts
                .borrow()
                .iter()
                .filter(|text| *text == "homing")
                .count();
            homings == 2 && desk.machine.positions() == [0; 4] || desk.is_over(1)
        });
        closest.get()
    };
    for at in (1..32).step_by(3) {
        let desk = Desk::new(N32);
        desk.sensor.set(SensorFault::NackAt(at));
        assert!(closest(&desk) > desk.machine.min_separation - 0.01, "{at}");
        drop(desk);
        let desk = Desk::new(N16);
        let time = 12_000 + 500 * at as u64;
        let is_stopped = Cell::new(false);
        desk.configure
            .set(|config| config.limits = EvidenceLimits::NONE);
        let stop = || {
            if Instant::now().as_millis() >= time && !is_stopped.replace(true) {
                desk.commands.borrow_mut().push_back((0, Command::Stop));
            }
        };
        let closest = Cell::new(9.0_f32);
        desk.run(Host::Absent, || {
            stop();
            if samples(&desk) > 0 {
                closest.set(closest.get().min(separation(desk.machine.angles())));
            }
            desk.is_over(1)
        });
        assert!(closest.get() > desk.machine.min_separation - 0.01, "{time}");
    }
}

/// A new firmware is calibrated by a hold: it homes, reads dark and white, and finds wrong cosines and angles.
#[test]
fn calibration_is_guided() {
    type Prepare = fn(&Desk);
    let cases: [(Prepare, Option<ErrorCode>); 5] = [
        (|_| (), None),
        (
            |desk| desk.light.lamp.set((0.0, 0.0)),
            Some(ErrorCode::WhiteNotBrighter),
        ),
        (|desk| desk.light.white.set(70_000.0), None),
        (
            |desk| desk.light.white.set(300_000.0),
            Some(ErrorCode::WhiteSaturated),
        ),
        (
            |desk| desk.machine.gears.set([0.5, 1.0, 1.0, 1.0]),
            Some(ErrorCode::TileReading),
        ),
    ];
    for (prepare, expected) in cases {
        let desk = Desk::uncalibrated(N8);
        desk.machine
            .arms
            .iter()
            .for_each(|arm| arm.position.set(40));
        desk.light.put(tile);
        prepare(&desk);
        desk.commands
            .borrow_mut()
            .push_back((0, Command::Calibrate));
        desk.patience.set(0);
        let is_calibrated = || {
            desk.texts
                .borrow()
                .iter()
                .any(|text| text.starts_with("calibrated"))
        };
        desk.run(Host::Absent, || {
            is_calibrated() || !desk.failures.borrow().is_empty()
        });
        let error = desk.failures.borrow().first().map(|error| error.code);
        assert_eq!(error, expected, "{:?}", desk.texts.borrow());
        assert_eq!(
            desk.with_store(|store| store.white().is_some()),
            expected.is_none()
        );
        if expected.is_none() {
            desk.light.put(plastic);
            desk.patience.set(2);
            desk.scan();
            assert!(desk.error() < 0.1 && desk.results.borrow()[0].0.implausible.is_none());
        }
    }
}

/// Right scans of metals, blacks, whites and colors raise no warning.
#[test]
fn right_scans_raise_no_warning() {
    let mut random = Random(7);
    for number in 0..20 {
        let mut triple = |low: f32, high: f32| [(); 3].map(|()| low + (high - low) * random.unit());
        let (diffuse, f0) = match number % 4 {
            0 => ([0.0; 3], triple(0.3, 0.95)),
            1 => (triple(0.01, 0.03), [0.04; 3]),
            2 => (triple(0.75, 0.9), [0.04; 3]),
            _ => (triple(0.05, 0.6), [0.04; 3]),
        };
        let alpha = 0.2 + 0.3 * random.unit();
        let desk = Desk::new(N8);
        desk.light.put(move |at| ggx(at, diffuse, f0, alpha));
        desk.scan();
        let residual = desk.results.borrow()[0].0;
        assert_eq!(residual.implausible, None, "{number}: {residual:?}");
        assert!(desk.error() < 0.1, "{number}: {}", desk.error());
    }
}

/// The checks of a scan take at most a tenth of its time.
#[test]
fn checks_take_little_time() {
    for recipe in [N8, N16] {
        let seconds = |configure: fn(&mut glimpse_core::driver::Config)| {
            let desk = Desk::new(recipe);
            desk.configure.set(configure);
            desk.scan();
            Instant::now().as_millis() as f32 / 1e3
        };
        let (with, without) = (
            seconds(|_| ()),
            seconds(|config| config.limits = EvidenceLimits::NONE),
        );
        println!(
            "{with} s with checks, {without} s without: {:.1} % more",
            100.0 * (with / without - 1.0)
        );
        assert!(with < 1.1 * without);
    }
}

/// A recipe for a time is read in its order, and a target loss ends a scan before all samples are read.
#[test]
fn orders_and_targets_count() {
    let desk = Desk::new(TIMED);
    desk.scan();
    let recipe = Recipe::parse(TIMED).unwrap();
    let read_at = desk.read_at.borrow();
    // The first is read with the lamp off, too.
    for ((_, expected), [theta_i, _, theta_o, _]) in recipe.directions().zip(&read_at[1..]) {
        let arms = Arms::from_directions(&expected);
        let error = (arms.theta_i - theta_i)
            .abs()
            .max((arms.theta_o - theta_o).abs());
        assert!(error < 0.01, "{read_at:?}");
    }
    drop(read_at);
    drop(desk);
    let desk = Desk::new(MASKED);
    desk.configure.set(|config| config.target_loss = Some(0.05));
    desk.scan();
    assert!((2..16).contains(&samples(&desk)), "{}", samples(&desk));
}

/// An hour of continuous scans erases a sector a few dozen times.
#[test]
fn flash_wears_slowly() {
    let desk = Desk::new(N8);
    desk.flash.borrow_mut().changes.clear();
    for scans in 1..=4 {
        desk.commands.borrow_mut().push_back((0, Command::Restart));
        desk.run(Host::Absent, || desk.is_over(scans));
    }
    let changes = &desk.flash.borrow().changes;
    let erases = changes
        .iter()
        .filter(|length| **length == SECTOR_BYTES)
        .count()
        / 16;
    let hours = Instant::now().as_millis() as f32 / 3.6e6;
    println!(
        "{} items a scan, {:.0} erases of a sector an hour",
        changes.len() / 4,
        erases as f32 / hours / 2.0
    );
    assert!(erases as f32 / hours < 60.0);
}

/// An axis that turns the wrong way after its directions were proven goes no further than its travel, whatever is pressed.
#[test]
fn travel_is_bounded_across_presses() {
    let desk = Desk::new(N8);
    desk.machine.arms[1].wiring.set(Wiring::Reversed);
    desk.patience.set(5);
    desk.run(Host::Absent, || desk.failures.borrow().len() == 4);
    let turns = (desk.machine.angles()[1] / std::f32::consts::TAU).abs();
    assert!(turns < 1.6, "{turns}");
}
