//! The first day on the bench: each fault is right, stated with the result, or ends with its cause. The table of
//! core/docs/faults.md is printed from here.

use glimpse_core::error::ErrorCode as Code;
use glimpse_desk::SensorFault::{self, *};
use glimpse_desk::Wiring::{self, *};
use glimpse_desk::{BLACK, Desk, METAL, ggx, tile};

use crate::N8;

#[derive(Debug, PartialEq)]
enum Outcome {
    /// A result without a warning, whose BRDF is off by less than 10 %.
    Right,
    /// A result with this warning.
    Warns(Code),
    /// This error, and no result.
    Fails(Code),
    /// A wrong result that no reading of this machine can show.
    Unnoticed,
}
use Outcome::{Fails, Right, Unnoticed, Warns};

/// The outcome of a fault, and its row of the table.
struct Found(Outcome, String);

/// Scans with a fault, and prints its row.
fn fault(name: &str, prepare: impl FnOnce(&mut Desk)) -> Found {
    let mut desk = Desk::new(N8);
    prepare(&mut desk);
    desk.scan();
    let (outcome, text) = match desk.failures.borrow().first() {
        Some(error) => (Fails(error.code), format!("fails: `{:?}`", error.code)),
        None => {
            let error = desk.error();
            let off = format!("off by {:.0} %", 100.0 * error);
            match desk.results.borrow()[0].implausible {
                Some(code) => (Warns(code), format!("warns: `{code:?}`, {off}")),
                None if error < 0.1 => (Right, format!("right, {off}")),
                None => (Unnoticed, format!("**not noticed**, {off}")),
            }
        }
    };
    let row = format!("| {name} | {text} |");
    println!("{row}");
    Found(outcome, row)
}

impl Found {
    /// Returns the row if it has another outcome, or if the document does not have it.
    fn must_be(self, expected: Outcome) -> Option<String> {
        let Self(outcome, row) = self;
        let is_known = include_str!("../../../../core/docs/faults.md").contains(&row);
        let error = format!("{row}: expected {expected:?}, in the document: {is_known}");
        (outcome != expected || !is_known).then_some(error)
    }
}

fn sensor(fault: SensorFault) -> impl FnOnce(&mut Desk) {
    move |desk| desk.after("reading", 3, move |desk| desk.sensor.set(Some(fault)))
}

/// The light of the room, and its change per second.
fn room(counts: f32, change: f32) -> impl FnOnce(&mut Desk) {
    move |desk| {
        desk.material = ggx(BLACK);
        desk.room = (counts, change);
    }
}

/// Lost steps.
fn lost(axis: usize, steps: u32) -> impl FnOnce(&mut Desk) {
    let stall = move |desk: &Desk| desk.machine.arms[axis].stalled.set(steps);
    move |desk| desk.after("reading", 3, stall)
}

fn gears(gears: [f32; 4]) -> impl FnOnce(&mut Desk) {
    move |desk| desk.machine.gears = gears
}

fn wiring(axis: usize, wiring: Wiring) -> impl FnOnce(&mut Desk) {
    move |desk| desk.machine.arms[axis].wiring.set(wiring)
}

fn scatter(axis: usize, steps: i32) -> impl FnOnce(&mut Desk) {
    move |desk| desk.machine.arms[axis].scatter = steps
}

/// New settings, whose directions are unproven.
fn unproven(axis: usize, wiring: Wiring, position: i32) -> impl FnOnce(&mut Desk) {
    move |desk| {
        desk.machine.settings[0].tolerance = 9;
        desk.machine.place([40; 4]);
        desk.machine.arms[axis].wiring.set(wiring);
        desk.machine.arms[axis].position.set(position);
    }
}

#[test]
fn every_fault_is_right_stated_or_named() {
    let errors = [
        fault("no fault: plastic", |_| ()).must_be(Right),
        fault("no fault: metal", |desk| desk.material = ggx(METAL)).must_be(Right),
        fault("no fault: black lacquer", room(0.0, 0.0)).must_be(Right),
        fault("no fault: white tile", |desk| desk.material = tile()).must_be(Right),
        fault("sensor: no power in reading 4", sensor(PowerLoss)).must_be(Fails(Code::SensorReset)),
        fault("sensor: does not answer", sensor(Absent)).must_be(Fails(Code::Sensor)),
        fault("sensor: its counts are stuck", sensor(Stuck)).must_be(Fails(Code::SensorStuck)),
        fault("sensor: loses its settings after reading 3", |desk| {
            desk.after("reading", 3, |desk| desk.registers.set([0; 32]));
        })
        .must_be(Right),
        fault("sensor: half of a highlight saturates it", |desk| {
            desk.material = ggx(METAL);
            desk.white_counts = 20_000.0;
            desk.calibrate();
        })
        .must_be(Warns(Code::Saturated)),
        fault("lamp: off", |desk| desk.lamp.0 = 0.0).must_be(Warns(Code::RoomLight)),
        fault("lamp: always on", |desk| desk.is_always_lit = true).must_be(Fails(Code::LampStuck)),
        fault("lamp: 80 %, then 1 % more each second", |desk| {
            desk.lamp = (0.8, 0.01)
        })
        .must_be(Warns(Code::Drift)),
        fault("lamp: 5 % less than calibrated", |desk| desk.lamp.0 = 0.95).must_be(Right),
        fault("lamp: 20 % less than calibrated", |desk| desk.lamp.0 = 0.8).must_be(Unnoticed),
        fault("room light: 200 counts, black lacquer", room(200.0, 0.0)).must_be(Right),
        fault("room light: 800 counts, black lacquer", room(800.0, 0.0)).must_be(Right),
        fault("room light: 4,000 counts", room(4e3, 0.0)).must_be(Fails(Code::LampStuck)),
        fault("room light: gains 5 counts a second", room(0.0, 5.0)).must_be(Warns(Code::Drift)),
        fault(
            "lamp without a switch: off, 30 counts of room light",
            |desk| {
                desk.config.limits.dark = 0.0;
                desk.lamp.0 = 0.0;
                desk.room.0 = 30.0;
            },
        )
        .must_be(Unnoticed),
        fault("theta_i loses 64 steps after reading 3", lost(0, 64))
            .must_be(Fails(Code::LostSteps)),
        fault("phi_o loses 64 steps after reading 3", lost(3, 64)).must_be(Fails(Code::LostSteps)),
        fault("theta_o's switch varies by 3 steps", scatter(2, 3)).must_be(Right),
        fault("theta_o's switch varies by 300 steps", scatter(2, 300))
            .must_be(Fails(Code::SwitchBounces)),
        fault("phi_i's wire is broken", wiring(1, Broken)).must_be(Fails(Code::SwitchStuck)),
        fault("theta_i's motor has no power", wiring(0, Jammed))
            .must_be(Fails(Code::SwitchNotFound)),
        fault("all axes with 32 microsteps instead of 16", gears([0.5; 4])).must_be(Unnoticed),
        fault("theta_i with 32 microsteps", gears([0.5, 1.0, 1.0, 1.0])).must_be(Unnoticed),
        fault("theta_i with 32 microsteps, and a far switch", |desk| {
            desk.machine.gears[0] = 0.5;
            desk.machine.add_far_switches();
            desk.calibrate();
        })
        .must_be(Fails(Code::Scale)),
        fault("new firmware: not calibrated", |desk| desk.erase())
            .must_be(Fails(Code::NotCalibrated)),
        fault(
            "new settings: theta_o is reversed",
            unproven(2, Reversed, 40),
        )
        .must_be(Fails(Code::Direction)),
        fault(
            "new settings: phi_o is elsewhere",
            unproven(3, Intact, 3000),
        )
        .must_be(Fails(Code::Direction)),
    ];
    let errors: Vec<_> = errors.into_iter().flatten().collect();
    assert!(errors.is_empty(), "{errors:#?}");
}
