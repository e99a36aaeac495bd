//! Scans over stops, restarts, calibrations, and the order of readings.

use std::cell::{Cell, RefCell};
use std::future::pending;

use embassy_time::Instant;
use glimpse_core::error::ErrorCode as Code;
use glimpse_core::geometry::Arms;
use glimpse_core::scan::EvidenceLimits;
use glimpse_desk::{Desk, Effect, Line, PLASTIC, SECTOR_BYTES, SensorFault, ggx, tile};
use glimpse_scanner::{Command, Event, Operator};

use crate::random::Random;
use crate::{N8, N16};

static N32: &[u8] = include_bytes!("../../../../trainer/recipes/completed/neural-n32.recipe");
static TIMED: &[u8] = include_bytes!("../../../../trainer/recipes/timed/neural-n16.recipe");
static MASKED: &[u8] = include_bytes!("../../../../trainer/recipes/masked/neural-n16.recipe");

/// A reading that fails, and a stop of the last homing, cost no reading that was made before.
#[test]
fn stops_cost_no_readings() {
    for (text, count, code) in [("reading", 11, Code::Sensor), ("homing", 2, Code::Stopped)] {
        let desk = Desk::new(N16);
        desk.run(|| {
            let is_due = desk.count(text) == count && desk.failures.borrow().is_empty();
            match code {
                Code::Sensor => desk.sensor.set(is_due.then_some(SensorFault::Absent)),
                _ => desk.command.set(is_due.then_some(Command::Stop)),
            }
            !desk.results.borrow().is_empty()
        });
        assert_eq!(desk.failures.borrow()[0].code, code);
        assert_eq!(desk.count("reading"), 16);
    }
}

/// A restart while the arms rest costs no reading.
#[test]
fn restarts_cost_no_readings() {
    for count in [2, 9, 16] {
        let desk = Desk::new(N16);
        desk.after("reading", count, |desk| desk.registers.set([0; 32]));
        // Until the next one begins.
        desk.run(|| desk.count("reading") == count && desk.registers.get()[0] > 0);
        desk.scan();
        assert_eq!([desk.count("reading"), desk.count("failed")], [16, 0]);
        let restored = desk.results.borrow()[0].evidence.restored;
        assert_eq!(usize::from(restored), count);
        assert!(desk.error() < 0.1);
    }
}

/// A complete scan from before a restart is offered as that. If it is shown, the host receives that it is old. The host
/// receives each error as well.
#[test]
fn old_scan_is_never_new() {
    let mut desk = Desk::new(N8);
    desk.scan();
    desk.material = tile();
    desk.line = Line::Host;
    desk.run(|| desk.host.borrow().finished.len() == 1);
    assert_eq!(desk.count("a complete scan is saved"), 1);
    let old = desk.host.borrow().finished[0];
    let evidence = (old.implausible, old.evidence.restored);
    assert_eq!(evidence, (Some(Code::Restored), 8));
    // The next press scans the next material.
    desk.command.set(Some(Command::Restart));
    desk.run(|| desk.host.borrow().finished.len() == 2);
    assert_eq!(desk.count("reading"), 8 + 8);
    assert_eq!(desk.host.borrow().finished[1].implausible, None);
    desk.command.set(Some(Command::Restart));
    desk.after("reading", 19, |desk| desk.machine.arms[3].stalled.set(64));
    desk.run(|| !desk.host.borrow().failures.is_empty());
    assert_eq!(desk.host.borrow().failures, *desk.failures.borrow());
    assert_eq!(desk.failures.borrow()[0].code, Code::LostSteps);
}

/// After stops of moves and homings, lamp and sensor stay apart.
#[test]
fn homing_keeps_lamp_and_sensor_apart() {
    let random = RefCell::new(Random(3));
    for (recipe, min_separation) in [(N32, 0.19), (MASKED, 0.6)].repeat(2) {
        let mut desk = Desk::new(recipe);
        desk.machine.min_separation = min_separation;
        desk.calibrate();
        desk.run(|| {
            let now = Instant::now().as_micros();
            if desk.count("reading") > 0 && now.is_multiple_of(500) {
                assert!(desk.machine.separation() > min_separation - 1e-4);
                if desk.count("failed") < 9 && random.borrow_mut().bits().is_multiple_of(2500) {
                    desk.command.set(Some(Command::Stop));
                }
            }
            !desk.results.borrow().is_empty()
        });
        assert_eq!(desk.count("failed"), 9);
    }
}

/// A new firmware is calibrated by a hold: it homes, which proves its directions, reads dark and white, and finds wrong
/// cosines and angles.
#[test]
fn calibration_is_guided() {
    type Prepare = fn(&mut Desk);
    let cases: [(Prepare, Option<Code>); 5] = [
        (|_| (), None),
        (|desk| desk.lamp.0 = 0.0, Some(Code::WhiteNotBrighter)),
        (|desk| desk.white_counts = 70_000.0, None),
        (|desk| desk.white_counts = 3e5, Some(Code::WhiteSaturated)),
        (|desk| desk.machine.gears[0] = 0.5, Some(Code::TileReading)),
    ];
    for (prepare, expected) in cases {
        let mut desk = Desk::new(N8);
        desk.erase();
        desk.material = tile();
        prepare(&mut desk);
        desk.command.set(Some(Command::Calibrate));
        desk.run(|| desk.count("calibrated") + desk.count("failed") > 0);
        let error = desk.failures.borrow().first().map(|error| error.code);
        assert_eq!(error, expected, "{:?}", desk.texts.borrow());
        let is_white_saved = desk.with_store(|store| store.white().is_some());
        assert_eq!(is_white_saved, expected.is_none());
        if expected.is_none() {
            desk.material = ggx(PLASTIC);
            desk.scan();
            assert!(desk.error() < 0.1 && desk.results.borrow()[0].implausible.is_none());
        }
        let is_proven = |desk: &Desk| {
            let settings = desk.machine.arms(false).settings_checksum();
            desk.with_store(|store| store.is_proven(settings))
        };
        assert!(is_proven(&desk));
        desk.machine.settings[3].reversed = true;
        assert!(!is_proven(&desk));
    }
}

/// Right scans of metals, blacks, whites and colors raise no warning.
#[test]
fn right_scans_raise_no_warning() {
    let mut random = Random(7);
    for number in 0..20 {
        let (albedo, f0) = [
            ([0.0, 0.0], [0.3, 0.95]),
            ([0.01, 0.03], [0.04, 0.04]),
            ([0.75, 0.9], [0.04, 0.04]),
            ([0.05, 0.6], [0.04, 0.04]),
        ][number % 4];
        let mut random = |[low, high]: [f32; 2]| low + (high - low) * random.uniform() as f32;
        let [albedo, f0] = [albedo, f0].map(|range| [range; 3].map(&mut random));
        let mut desk = Desk::new(N8);
        desk.material = ggx((albedo, f0, random([0.2, 0.5])));
        desk.scan();
        let residual = desk.results.borrow()[0];
        assert_eq!(residual.implausible, None, "{number}: {residual:?}");
        assert!(desk.error() < 0.1, "{number}: {}", desk.error());
    }
}

/// The checks of a scan take at most a tenth of its time.
#[test]
fn checks_take_little_time() {
    for recipe in [N8, N16] {
        let [with, without] = [EvidenceLimits::DEFAULT, EvidenceLimits::NONE].map(|limits| {
            let mut desk = Desk::new(recipe);
            desk.config.limits = limits;
            desk.scan();
            Instant::now().as_millis() as f32 / 1e3
        });
        assert!(with < 1.1 * without, "{with} {without}");
    }
}

/// A recipe for a time is read in its order, and a target loss ends a scan before all samples are read.
#[test]
fn orders_and_targets_count() {
    let desk = Desk::new(TIMED);
    desk.scan();
    // The first is read with the lamp off, too.
    let readings = desk.readings.borrow();
    let samples = desk.recipe.directions().zip(&readings[1..]);
    for ((_, expected), [theta_i, _, theta_o, _]) in samples {
        let expected = Arms::from_directions(&expected);
        assert!((expected.theta_i - theta_i).abs() < 0.01);
        assert!((expected.theta_o - theta_o).abs() < 0.01);
    }
    drop(readings);
    drop(desk);
    let mut desk = Desk::new(MASKED);
    desk.config.target_loss = Some(0.05);
    desk.scan();
    assert!((2..16).contains(&desk.count("reading")));
}

/// An hour of continuous scans erases a sector a few dozen times.
#[test]
fn flash_wears_slowly() {
    let desk = Desk::new(N8);
    desk.flash.borrow_mut().changes.clear();
    for scans in 1..=4 {
        desk.command.set(Some(Command::Restart));
        desk.run(|| desk.results.borrow().len() == scans);
    }
    let changes = &desk.flash.borrow().changes;
    let is_erase = |length: &&usize| **length == SECTOR_BYTES;
    let erases = changes.iter().filter(is_erase).count() / 16;
    let hours = Instant::now().as_millis() as f32 / 3.6e6;
    assert!(erases as f32 / hours < 60.0);
}

/// Nothing moves after a failure, and a flash that fails in a scan ends it.
#[test]
fn nothing_moves_after_a_failure() {
    let desk = Desk::new(N8);
    desk.after("reading", 3, |desk| {
        desk.command.set(Some(Command::Stop));
    });
    let operator = &mut Patient(&desk);
    let stopped = Cell::new(None);
    desk.run_with(operator, || {
        if desk.count("failed") == 1 && stopped.get().is_none() {
            stopped.set(Some((Instant::now(), desk.machine.positions())));
        }
        stopped
            .get()
            .is_some_and(|(at, _)| at.elapsed().as_secs() > 60)
    });
    assert_eq!(stopped.get().unwrap().1, desk.machine.positions());
    assert_eq!(desk.failures.borrow()[0].code, Code::Stopped);
    drop(desk);

    let desk = Desk::new(N8);
    desk.flash.borrow_mut().cut = Some((25, Effect::Bits(1)));
    desk.flash.borrow_mut().changes.clear();
    desk.scan();
    assert_eq!(desk.failures.borrow()[0].code, Code::Storage);
}

/// An operator who presses before the first failure only.
struct Patient<'a>(&'a Desk);

impl Operator for Patient<'_> {
    async fn command(&mut self) -> Command {
        let mut desk = self.0;
        match desk.count("failed") {
            0 => desk.command().await,
            _ => pending().await,
        }
    }

    fn show(&mut self, _event: &mut Event<'_>) {}
}
