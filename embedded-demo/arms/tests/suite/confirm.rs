//! The arms move, and saved readings are continued, only after a command.

use crate::board::{POSITIONS, SECOND, TestBoard, is_finished, simulated};
use crate::support::Flash;
use glimpse_arms::scanner::{Button, Command, Event, Outcome, ScannerError};
use glimpse_arms::simulated::SimulatedScanner;

/// Returns the numbers of saved readings that the firmware has reported.
fn saved_counts(board: &TestBoard) -> Vec<u16> {
    let saved = |event: &Event| match event {
        Event::Saved { readings } => Some(*readings),
        _ => None,
    };
    board.events.iter().filter_map(saved).collect()
}

/// Scans until a power cut after five readings. Returns the arms and the flash.
fn interrupted_scan() -> (SimulatedScanner, Flash) {
    let (simulated, mut flash) = (simulated(), Flash::new(6));
    let mut count = 0;
    let mut board = TestBoard::new(600 * SECOND, move |event| {
        count += u32::from(matches!(event, Event::Read { .. }));
        count == 5
    });
    board.commands.push_back((0, Command::NewScan));
    board.serve(&simulated, &mut flash);
    assert_eq!(board.reads(), 5);
    (simulated, flash)
}

#[test]
fn arms_wait_for_command_after_power_up() {
    let simulated = simulated();
    let mut board = TestBoard::new(60 * SECOND, |_| false);
    board.serve(&simulated, &mut Flash::new(6));
    assert_eq!(simulated.positions(), POSITIONS);
    assert_eq!(board.events, []);
}

#[test]
fn reports_saved_readings_once_after_power_cut() {
    let (simulated, mut flash) = interrupted_scan();
    let positions = simulated.positions();
    let mut board = TestBoard::new(120 * SECOND, |_| false);
    board.serve(&simulated, &mut flash);
    assert_eq!(simulated.positions(), positions);
    assert_eq!(
        board.events,
        [Event::Saved { readings: 5 }],
        "it reports once"
    );
}

#[test]
fn continue_resumes_saved_readings() {
    let (simulated, mut flash) = interrupted_scan();
    let mut board = TestBoard::new(600 * SECOND, is_finished);
    board.commands.push_back((10 * SECOND, Command::Continue));
    board.serve(&simulated, &mut flash);
    assert_eq!(saved_counts(&board), [5]);
    assert_eq!(board.outcomes(), [Outcome::NoHost, Outcome::Finished]);
    assert_eq!(board.reads(), 3);
}

/// Otherwise five readings of one material and three of the next one would be fitted.
#[test]
fn new_scan_deletes_saved_readings() {
    let (simulated, mut flash) = interrupted_scan();
    let mut board = TestBoard::new(600 * SECOND, is_finished);
    board.commands.push_back((10 * SECOND, Command::NewScan));
    board.serve(&simulated, &mut flash);
    assert_eq!(board.outcomes(), [Outcome::NoHost, Outcome::Finished]);
    assert_eq!(board.reads(), 8);
}

#[test]
fn continue_without_saved_readings_is_ignored() {
    let simulated = simulated();
    let mut board = TestBoard::new(60 * SECOND, |_| false);
    board.commands.push_back((SECOND, Command::Continue));
    board.serve(&simulated, &mut Flash::new(6));
    assert_eq!(simulated.positions(), POSITIONS);
    assert_eq!(board.events, [Event::NothingSaved]);
}

/// Returns a board on which an arm gets stuck at the sixth reading of the first scan. After the scan's failure it is
/// free. `ends` ends the test run.
fn board_with_stuck_arm(simulated: &SimulatedScanner, ends: fn(&Event) -> bool) -> TestBoard<'_> {
    let mut count = 0;
    let mut board = TestBoard::new(600 * SECOND, move |event| {
        count += u32::from(matches!(event, Event::Read { .. }));
        match event {
            Event::Read { .. } if count == 6 => simulated.stall(2, u32::MAX),
            Event::Ended(Outcome::Failed(_)) => simulated.reset(POSITIONS),
            _ => {}
        }
        ends(event)
    });
    board.commands.push_back((0, Command::NewScan));
    board
}

/// The confirmed readings of a failed scan can be continued after a reset.
#[test]
fn scan_continues_after_machine_failure_and_reset() {
    let (simulated, mut flash) = (simulated(), Flash::new(6));
    let mut board = board_with_stuck_arm(&simulated, |event| {
        matches!(event, Event::Ended(Outcome::Failed(_)))
    });
    board.serve(&simulated, &mut flash);
    let failed = board.outcomes().pop();
    let Some(Outcome::Failed(ScannerError::Station(_) | ScannerError::LostSteps(_))) = failed
    else {
        panic!("{:?}", board.events);
    };
    let mut board = TestBoard::new(600 * SECOND, is_finished);
    board.commands.push_back((SECOND, Command::Continue));
    board.serve(&simulated, &mut flash);
    assert_eq!(board.outcomes().last(), Some(&Outcome::Finished));
    assert_eq!(
        board.reads(),
        4,
        "only the readings that the stuck arm has invalidated"
    );
}

/// A new scan starts over, because it may be another material.
#[test]
fn new_scan_after_failure_starts_over() {
    let simulated = simulated();
    let mut board = board_with_stuck_arm(&simulated, is_finished);
    board.commands.push_back((300 * SECOND, Command::NewScan));
    board.serve(&simulated, &mut Flash::new(6));
    assert_eq!(board.outcomes().last(), Some(&Outcome::Finished));
    let is_failed = |event: &Event| matches!(event, Event::Ended(Outcome::Failed(_)));
    let mut scans = board.events.split(is_failed);
    let reads = |scan: &[Event]| {
        let reads = scan
            .iter()
            .filter(|event| matches!(event, Event::Read { .. }));
        reads.count()
    };
    let (_, second) = (scans.next(), scans.next());
    assert_eq!(second.map(reads), Some(8));
    assert_eq!(scans.count(), 0, "no other failure");
}

/// Polls a button every millisecond; `contact` is its state at each time. Returns the commands and their times, ms.
fn press(milliseconds: u32, contact: impl Fn(u32) -> bool) -> Vec<(u32, Command)> {
    let mut button = Button::default();
    let mut poll = |now| {
        button
            .poll(contact(now), 1000)
            .map(|command| (now, command))
    };
    (0..milliseconds).filter_map(&mut poll).collect()
}

#[test]
fn short_press_is_new_scan_and_long_press_continues() {
    let short = press(10_000, |now| (1000..1300).contains(&now));
    assert_eq!(short, [(1320, Command::NewScan)]);
    let long = press(10_000, |now| (1000..5000).contains(&now));
    assert_eq!(long, [(3000, Command::Continue)], "once");
}

#[test]
fn button_is_debounced() {
    let bouncing = press(10_000, |now| match now {
        1000..1010 | 1300..1310 => now % 2 == 0,
        1010..1300 => true,
        _ => false,
    });
    assert_eq!(bouncing.len(), 1);
    assert_eq!(bouncing[0].1, Command::NewScan);
    assert_eq!(press(10_000, |now| (1000..1015).contains(&now)), []);
}

/// A short circuit or a blocked button does not start the arms.
#[test]
fn button_pressed_at_start_is_ignored_until_release() {
    assert_eq!(press(10_000, |_| true), []);
    assert_eq!(press(10_000, |now| now < 5000), []);
    let again = press(10_000, |now| now < 5000 || (6000..6500).contains(&now));
    assert_eq!(again, [(6520, Command::NewScan)]);
}

/// A caller that polls every four seconds cannot see a long press.
#[test]
fn late_polls_do_not_lengthen_press() {
    let mut button = Button::default();
    let contacts = [false, false, false, true, true, true, true];
    let commands = contacts.map(|contact| button.poll(contact, 4_000_000));
    assert_eq!(commands, [None; 7]);
}
