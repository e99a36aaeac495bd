//! The first day on the bench: each fault is right, stated with the result, or ends with its cause. The table of
//! core/docs/faults.md is printed from here.

use glimpse_core::error::ErrorCode;
use glimpse_desk::Desk;
use glimpse_desk::optics::{SensorFault, black, metal, tile};

pub(crate) static N8: &[u8] = include_bytes!("../../../../trainer/recipes/completed/neural-n8.recipe");
pub(crate) static N16: &[u8] = include_bytes!("../../../../trainer/recipes/completed/neural-n16.recipe");

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
    let error = desk.error(desk.light.material.get());
    let percent = format!("{:.0} %", 100.0 * error);
    match residual.implausible {
        Some(code) => (Warns(code), format!("finishes with a warning: {} (off by {percent})", code.text())),
        None if error < 0.1 => (Right, format!("right (off by {percent})")),
        None => (Unnoticed, format!("**not noticed** (off by {percent})")),
    }
}

struct Row {
    name: &'static str,
    recipe: &'static [u8],
    prepare: fn(&Desk),
    expected: Outcome,
}

const fn row(name: &'static str, prepare: fn(&Desk), expected: Outcome) -> Row {
    Row {
        name,
        recipe: N8,
        prepare,
        expected,
    }
}

const fn row16(name: &'static str, prepare: fn(&Desk), expected: Outcome) -> Row {
    Row {
        recipe: N16,
        ..row(name, prepare, expected)
    }
}

const ROWS: &[Row] = &[
    row("no fault: plastic", |_| (), Right),
    row("no fault: metal", |desk| desk.light.material.set(metal), Right),
    row("no fault: black lacquer", |desk| desk.light.material.set(black), Right),
    row("no fault: white tile", |desk| desk.light.material.set(tile), Right),
    row16("no fault: plastic, 16 readings", |_| (), Right),
    row("the sensor loses its settings after reading 4", |desk| desk.sensor.set(SensorFault::PowerLossAfter(4)), Right),
    row("the sensor loses its power in reading 4", |desk| desk.sensor.set(SensorFault::PowerLossIn(4)), Fails(ErrorCode::SensorReset)),
    row("no sensor", |desk| desk.sensor.set(SensorFault::Absent), Fails(ErrorCode::Sensor)),
    row("the sensor's counts are stuck", |desk| desk.sensor.set(SensorFault::Stuck), Fails(ErrorCode::SensorStuck)),
    row("the lamp is off", |desk| desk.light.lamp.set((0.0, 0.0)), Warns(ErrorCode::RoomLight)),
    row("the lamp cannot be switched off", |desk| desk.light.is_always_on.set(true), Fails(ErrorCode::LampStuck)),
    row("the lamp has 80 % at first and warms up, 1 % a second", |desk| desk.light.lamp.set((0.8, 0.01)), Warns(ErrorCode::Drift)),
    row("the lamp is 10 % weaker than at the calibration", |desk| desk.light.lamp.set((0.9, 0.0)), Right),
    row("the lamp is 30 % weaker than at the calibration", |desk| desk.light.lamp.set((0.7, 0.0)), Unnoticed),
    row("room light of 200 counts", |desk| desk.light.room.set((200.0, 0.0)), Right),
    row("room light of 4,000 counts", |desk| desk.light.room.set((4000.0, 0.0)), Right),
    row("room light of 200 counts, black lacquer", |desk| {
        desk.light.room.set((200.0, 0.0));
        desk.light.material.set(black);
    }, Right),
    row("room light of 20,000 counts", |desk| desk.light.room.set((20_000.0, 0.0)), Fails(ErrorCode::LampStuck)),
    row("room light that grows by 10 counts a second", |desk| desk.light.room.set((0.0, 10.0)), Warns(ErrorCode::RoomLight)),
    row("the highlight of a metal saturates the nominal exposure", |desk| {
        desk.light.material.set(metal);
        desk.light.white.set(20_000.0);
    }, Right),
];

/// Each row has its outcome, and the document has the same rows.
#[test]
fn every_fault_is_right_stated_or_named() {
    let document = include_str!("../../../../core/docs/faults.md");
    let mut missing = Vec::new();
    let mut wrong = Vec::new();
    for row in ROWS {
        let desk = Desk::new(row.recipe);
        (row.prepare)(&desk);
        let (outcome, text) = outcome(&desk);
        let line = format!("| {} | {text} |", row.name);
        println!("{line}");
        if outcome != row.expected {
            wrong.push(format!("{line} instead of {:?}: {:?} {:?}", row.expected, desk.texts.borrow(), desk.results.borrow().first().map(|r| r.0)));
        }
        if !document.lines().any(|known| known == line) {
            missing.push(line);
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert!(missing.is_empty(), "core/docs/faults.md does not have these rows: {missing:#?}");
}
