//! Unreadable samples, with recipes that tolerate missing readings and with others.

use std::cell::Cell;

use crate::board::{
    GRAY, MASKED, NEGATIVE, PHONG, SECOND, TestBoard, scan_once, scripted_station, simulated,
};
use glimpse_arms::scanner::{Event, Outcome, ScannerError};
use glimpse_arms::sensor::SensorError;
use glimpse_arms::station::StationError;
use glimpse_core::link::Failure;

/// Scans once with a recipe. The sensor counts `lit(n)` at its nth reading. Also returns the number of readings.
fn scan(recipe: &[u8], lit: impl Fn(u32) -> Option<u16>) -> (Vec<Event>, Outcome, u32) {
    scan_watched(recipe, lit, |_, _| {})
}

/// As [`scan`]; `watch` receives the simulated scanner and all events.
fn scan_watched(
    recipe: &[u8],
    lit: impl Fn(u32) -> Option<u16>,
    watch: impl Fn(&glimpse_arms::simulated::SimulatedScanner, &Event),
) -> (Vec<Event>, Outcome, u32) {
    let (simulated, is_lit) = (simulated(), Cell::new(false));
    let mut reads = 0;
    let mut count = || {
        reads += 1;
        lit(reads)
    };
    let station = scripted_station(&simulated, &is_lit, &mut count);
    let mut board = TestBoard::new(1200 * SECOND, |event| {
        watch(&simulated, event);
        false
    });
    let outcome = scan_once(station, recipe, &mut board);
    (board.events, outcome, reads)
}

fn skipped(events: &[Event]) -> Vec<u16> {
    let skipped = |event: &Event| match event {
        Event::Skipped { index } => Some(*index),
        _ => None,
    };
    events.iter().filter_map(skipped).collect()
}

/// Returns the sorted indices of the readings that were taken.
fn read(events: &[Event]) -> Vec<u16> {
    let read = |event: &Event| match event {
        Event::Read { index, .. } => Some(*index),
        _ => None,
    };
    let mut indices: Vec<u16> = events.iter().filter_map(read).collect();
    indices.sort_unstable();
    indices
}

/// The converter fails, or returns invalid counts, three times at the third sample. The arms go home first, to exclude
/// lost steps as the reason.
#[test]
fn unreadable_sample_is_skipped() {
    for fault in [None, Some(NEGATIVE)] {
        let (events, outcome, reads) = scan(MASKED, |reads| match reads {
            3..=5 => fault,
            _ => Some(GRAY),
        });
        assert_eq!(outcome, Outcome::Finished, "{events:?}");
        let [skipped] = skipped(&events)[..] else {
            panic!("{events:?}");
        };
        let others: Vec<u16> = (0..16).filter(|index| *index != skipped).collect();
        assert_eq!(read(&events), others);
        assert_eq!(reads, 15 + 3);
        let before = events
            .iter()
            .position(|event| *event == Event::Skipped { index: skipped });
        let home = events[before.unwrap() - 1];
        assert_eq!(home, Event::Home { confirmed: 2 });
    }
}

#[test]
fn sample_read_at_third_attempt_is_not_skipped() {
    let (events, outcome, reads) = scan(MASKED, |reads| match reads {
        3 => None,
        4 => Some(NEGATIVE),
        _ => Some(GRAY),
    });
    assert_eq!(outcome, Outcome::Finished, "{events:?}");
    assert_eq!(skipped(&events), []);
    assert_eq!((read(&events).len(), reads), (16, 16 + 2));
}

/// Lost steps may be the reason. The sample is read again, with all samples since the last homing.
#[test]
fn sample_is_not_skipped_after_lost_steps() {
    let (events, outcome, _) = scan_watched(
        MASKED,
        |reads| (!(3..=5).contains(&reads)).then_some(GRAY),
        |simulated, event| {
            if matches!(event, Event::ReadFailed { .. }) {
                simulated.stall(3, 40);
            }
        },
    );
    assert_eq!(outcome, Outcome::Finished, "{events:?}");
    let lost = events
        .iter()
        .filter(|event| matches!(event, Event::LostSteps(_)));
    assert_eq!(lost.count(), 1);
    assert_eq!(skipped(&events), []);
    assert_eq!(read(&events).len(), 2 + 16);
}

/// For a recipe that needs every reading.
#[test]
fn unreadable_sample_ends_scan_of_intolerant_recipe() {
    let (events, outcome, reads) = scan(PHONG, |reads| (reads < 3).then_some(GRAY));
    let error = StationError::Sensor(SensorError::Converter);
    assert_eq!(
        outcome,
        Outcome::Failed(ScannerError::Station(error)),
        "{events:?}"
    );
    assert_eq!(reads, 2 + 3);

    let (_, outcome, reads) = scan(PHONG, |reads| Some(if reads < 3 { GRAY } else { NEGATIVE }));
    let Outcome::Failed(ScannerError::Scan(Failure::Reading { .. })) = outcome else {
        panic!("{outcome:?}");
    };
    assert_eq!(reads, 2 + 3);
}

/// The scan ends with the sensor's error, not because of missing readings.
#[test]
fn failing_sensor_ends_scan_with_its_error() {
    let (events, outcome, reads) = scan(MASKED, |_| None);
    let error = StationError::Sensor(SensorError::Converter);
    assert_eq!(outcome, Outcome::Failed(ScannerError::Station(error)));
    assert_eq!((skipped(&events).len(), reads), (16, 3 * 16));
}
