//! The first day on the bench: each fault is right, stated with the result, or ends with its cause. The table of
//! core/docs/faults.md is printed from here.

use glimpse_core::error::ErrorCode;
use glimpse_desk::optics::{SensorFault, black, metal, tile};
use glimpse_desk::{Desk, Wiring};

pub(crate) static N8: &[u8] =
    include_bytes!("../../../../trainer/recipes/completed/neural-n8.recipe");
pub(crate) static N16: &[u8] =
    include_bytes!("../../../../trainer/recipes/completed/neural-n16.recipe");

/// What a fault must lead to.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Outcome {
    /// A result without a warning, whose BRDF is off by less than 10 %.
    Right,
    /// A result with this warning.
    Warns(ErrorCode),
    /// This error, and no result.
    Fails(ErrorCode),
    /// A wrong result that no reading of this machine can show.
    Unnoticed,
}
use Outcome::{Fails, Right, Unnoticed, Warns};

/// Scans a material with a fault. Returns the outcome, and its text for the table.
fn outcome(desk: &Desk) -> (Outcome, String) {
    desk.patience.set(1); // for the question at the start
    desk.scan();
    if let Some(error) = desk.failures.borrow().first() {
        return (Fails(error.code), format!("fails: {error}"));
    }
    let (residual, _) = desk.results.borrow()[0].clone();
    let error = desk.error();
    let percent = format!("{:.0} %", 100.0 * error);
    match residual.implausible {
        Some(code) => (
            Warns(code),
            format!(
                "finishes with a warning: {} (off by {percent})",
                code.text()
            ),
        ),
        None if error < 0.1 => (Right, format!("right (off by {percent})")),
        None => (Unnoticed, format!("**not noticed** (off by {percent})")),
    }
}

struct Row {
    name: &'static str,
    recipe: &'static [u8],
    prepare: fn(&mut Desk),
    expected: Outcome,
}

const fn row(name: &'static str, prepare: fn(&mut Desk), expected: Outcome) -> Row {
    Row {
        name,
        recipe: N8,
        prepare,
        expected,
    }
}

const fn row16(name: &'static str, prepare: fn(&mut Desk), expected: Outcome) -> Row {
    Row {
        recipe: N16,
        ..row(name, prepare, expected)
    }
}

/// Flashes a new firmware, whose arms are on their switches.
fn renew(desk: &mut Desk) {
    desk.flash.borrow_mut().bytes.fill(0xFF);
    desk.machine
        .arms
        .iter()
        .for_each(|arm| arm.position.set(40));
}

fn gears(desk: &Desk, gears: [f32; 4]) {
    desk.machine.gears.set(gears);
}

/// Adds a far switch to the axes, 0.05 beyond their limits, at its true angle.
fn far_switches(desk: &mut Desk) {
    let gears = desk.machine.gears.get();
    for (number, settings) in desk.machine.settings.iter_mut().enumerate() {
        let far = match number {
            2 => settings.min_angle - 0.05,
            _ => settings.max_angle + 0.05,
        };
        settings.far = Some(far);
        let steps = (far - settings.home).abs() * settings.steps_per_radian * gears[number];
        desk.machine.arms[number].far.set(Some(steps as i32));
    }
    desk.save_proven();
}

const ROWS: &[Row] = &[
    row("no fault: plastic", |_| (), Right),
    row("no fault: metal", |desk| desk.light.put(metal), Right),
    row(
        "no fault: black lacquer",
        |desk| desk.light.put(black),
        Right,
    ),
    row("no fault: white tile", |desk| desk.light.put(tile), Right),
    row16("no fault: plastic, 16 readings", |_| (), Right),
    row(
        "sensor: loses its settings after reading 4",
        |desk| desk.sensor.set(SensorFault::PowerLossAfter(4)),
        Right,
    ),
    row(
        "sensor: loses its power in reading 4",
        |desk| desk.sensor.set(SensorFault::PowerLossIn(4)),
        Fails(ErrorCode::SensorReset),
    ),
    row(
        "sensor: does not answer",
        |desk| desk.sensor.set(SensorFault::Absent),
        Fails(ErrorCode::Sensor),
    ),
    row(
        "sensor: its counts are stuck",
        |desk| desk.sensor.set(SensorFault::Stuck),
        Fails(ErrorCode::LampStuck),
    ),
    row(
        "sensor: half of the highlight saturates it (a white of 20,000 counts, metal)",
        |desk| {
            desk.light.put(metal);
            calibrate(desk, 20_000.0);
        },
        Warns(ErrorCode::Saturated),
    ),
    row(
        "lamp: off",
        |desk| desk.light.lamp.set((0.0, 0.0)),
        Warns(ErrorCode::RoomLight),
    ),
    row(
        "lamp: cannot be switched off",
        |desk| desk.light.is_always_on.set(true),
        Fails(ErrorCode::LampStuck),
    ),
    row(
        "lamp: 80 % at first, warms up 1 % a second",
        |desk| desk.light.lamp.set((0.8, 0.01)),
        Warns(ErrorCode::Drift),
    ),
    row(
        "lamp: 5 % weaker than at the calibration",
        |desk| desk.light.lamp.set((0.95, 0.0)),
        Right,
    ),
    row(
        "lamp: 20 % weaker than at the calibration",
        |desk| desk.light.lamp.set((0.8, 0.0)),
        Unnoticed,
    ),
    row(
        "room light: 200 counts, black lacquer",
        |desk| {
            desk.light.room.set((200.0, 0.0));
            desk.light.put(black);
        },
        Right,
    ),
    row(
        "room light: 800 counts",
        |desk| desk.light.room.set((800.0, 0.0)),
        Right,
    ),
    row(
        "room light: 4,000 counts",
        |desk| desk.light.room.set((4_000.0, 0.0)),
        Fails(ErrorCode::LampStuck),
    ),
    row(
        "room light: grows by 5 counts a second, black lacquer",
        |desk| {
            desk.light.room.set((0.0, 5.0));
            desk.light.put(black);
        },
        Warns(ErrorCode::Drift),
    ),
    row(
        "axes: theta_i loses 64 steps after reading 3",
        |desk| stall(desk, 0, 64),
        Fails(ErrorCode::LostSteps),
    ),
    row(
        "axes: phi_o loses 64 steps after reading 3",
        |desk| stall(desk, 3, 64),
        Fails(ErrorCode::LostSteps),
    ),
    row(
        "axes: theta_o's switch opens 3 steps elsewhere",
        |desk| desk.machine.arms[2].scatter.set(3),
        Right,
    ),
    row(
        "axes: phi_i's wire breaks from the start",
        |desk| desk.machine.arms[1].wiring.set(Wiring::Broken),
        Fails(ErrorCode::SwitchStuck),
    ),
    row(
        "axes: theta_i's motor has no power",
        |desk| desk.machine.arms[0].wiring.set(Wiring::Jammed),
        Fails(ErrorCode::SwitchNotFound),
    ),
    row(
        "axes: theta_o turns the wrong way in a new firmware",
        |desk| {
            renew(desk);
            desk.save_white();
            desk.machine.arms[2].wiring.set(Wiring::Reversed);
        },
        Fails(ErrorCode::Direction),
    ),
    row(
        "axes: the arms of a new firmware are not at their switches",
        |desk| {
            renew(desk);
            desk.save_white();
            desk.machine.arms[3].position.set(3000);
        },
        Fails(ErrorCode::Direction),
    ),
    row(
        "a new firmware has no calibration",
        renew,
        Fails(ErrorCode::NotCalibrated),
    ),
    row(
        "axes: 32 microsteps instead of 16 on theta_i, with a second switch",
        |desk| {
            gears(desk, [0.5, 1.0, 1.0, 1.0]);
            far_switches(desk);
        },
        Fails(ErrorCode::Scale),
    ),
    row(
        "axes: a gear of 4.5 instead of 4 on phi_i, with a second switch",
        |desk| {
            gears(desk, [1.0, 1.125, 1.0, 1.0]);
            far_switches(desk);
        },
        Fails(ErrorCode::Scale),
    ),
    row(
        "axes: 32 microsteps instead of 16 on theta_i",
        |desk| gears(desk, [0.5, 1.0, 1.0, 1.0]),
        Unnoticed,
    ),
    row(
        "axes: 32 microsteps instead of 16 on all axes",
        |desk| gears(desk, [0.5; 4]),
        Unnoticed,
    ),
];

/// Loses steps after the third reading.
fn stall(desk: &Desk, axis: usize, steps: u32) {
    desk.stalls.set(Some((4, axis, steps)));
}

/// Changes lamp or exposure, and calibrates.
fn calibrate(desk: &Desk, white: f32) {
    desk.light.white.set(white);
    desk.save_white();
}

/// Each row has its outcome, and the document has the same rows.
#[test]
fn every_fault_is_right_stated_or_named() {
    let document = include_str!("../../../../core/docs/faults.md");
    let mut missing = Vec::new();
    let mut wrong = Vec::new();
    for row in ROWS {
        let mut desk = Desk::new(row.recipe);
        (row.prepare)(&mut desk);
        let (outcome, text) = outcome(&desk);
        let line = format!("| {} | {text} |", row.name);
        println!("{line}");
        if outcome != row.expected {
            wrong.push(format!(
                "{line} instead of {:?}: {:?} {:?}",
                row.expected,
                desk.texts.borrow(),
                desk.results.borrow().first().map(|r| r.0)
            ));
        }
        if !document.lines().any(|known| known == line) {
            missing.push(line);
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert!(
        missing.is_empty(),
        "core/docs/faults.md does not have these rows: {missing:#?}"
    );
}
