//! Nothing moves, and no readings are continued, before somebody confirms.

use crate::bench::{Board, POSITIONS, SECOND, is_finished, world};
use crate::support::Flash;
use glimpse_arms::scanner::{Button, Command, End, News, ScannerError};
use glimpse_arms::simulated::World;

/// The readings that the firmware asks about, each time it does.
fn asked(board: &Board) -> Vec<u16> {
    let saved = |news: &News| match news {
        News::Saved { readings } => Some(*readings),
        _ => None,
    };
    board.news.iter().filter_map(saved).collect()
}

/// Scans until the power is cut after five readings. Returns the arms and the flash.
fn five_readings() -> (World, Flash) {
    let (world, mut flash) = (world(), Flash::new(6));
    let mut count = 0;
    let mut board = Board::new(600 * SECOND, move |news| {
        count += u32::from(matches!(news, News::Read { .. }));
        count == 5
    });
    board.commands.push_back((0, Command::NewScan));
    board.serve(&world, &mut flash);
    assert_eq!(board.reads(), 5);
    (world, flash)
}

#[test]
fn after_power_up_nothing_moves_before_somebody_confirms() {
    let world = world();
    let mut board = Board::new(60 * SECOND, |_| false);
    board.serve(&world, &mut Flash::new(6));
    assert_eq!(world.positions(), POSITIONS);
    assert_eq!(board.news, []);
}

#[test]
fn after_a_power_cut_the_firmware_asks_and_waits_for_an_answer() {
    let (world, mut flash) = five_readings();
    let positions = world.positions();
    let mut board = Board::new(120 * SECOND, |_| false);
    board.serve(&world, &mut flash);
    assert_eq!(world.positions(), positions);
    assert_eq!(board.news, [News::Saved { readings: 5 }], "it asks once");
}

#[test]
fn continue_goes_on_with_the_saved_readings() {
    let (world, mut flash) = five_readings();
    let mut board = Board::new(600 * SECOND, is_finished);
    board.commands.push_back((10 * SECOND, Command::Continue));
    board.serve(&world, &mut flash);
    assert_eq!(asked(&board), [5]);
    assert_eq!(board.ends(), [End::Alone, End::Finished]);
    assert_eq!(board.reads(), 3);
}

/// Otherwise five readings of one material and three of the next one would be fitted.
#[test]
fn a_new_material_forgets_the_saved_readings() {
    let (world, mut flash) = five_readings();
    let mut board = Board::new(600 * SECOND, is_finished);
    board.commands.push_back((10 * SECOND, Command::NewScan));
    board.serve(&world, &mut flash);
    assert_eq!(board.ends(), [End::Alone, End::Finished]);
    assert_eq!(board.reads(), 8);
}

#[test]
fn continue_without_saved_readings_moves_nothing() {
    let world = world();
    let mut board = Board::new(60 * SECOND, |_| false);
    board.commands.push_back((SECOND, Command::Continue));
    board.serve(&world, &mut Flash::new(6));
    assert_eq!(world.positions(), POSITIONS);
    assert_eq!(board.news, [News::NothingSaved]);
}

/// A board on which an arm hangs in the sixth reading of the first scan; after the scan's failure it is free.
/// The bench ends by `ends`.
fn hanging(world: &World, ends: fn(&News) -> bool) -> Board<'_> {
    let mut count = 0;
    let mut board = Board::new(600 * SECOND, move |news| {
        count += u32::from(matches!(news, News::Read { .. }));
        match news {
            News::Read { .. } if count == 6 => world.stall(2, u32::MAX),
            News::End(End::Failed(_)) => world.place(POSITIONS),
            _ => {}
        }
        ends(news)
    });
    board.commands.push_back((0, Command::NewScan));
    board
}

/// A scan that the machine has spoiled can be continued after a reset, with the confirmed readings.
#[test]
fn after_a_failure_of_the_machine_and_a_reset_the_scan_can_be_continued() {
    let (world, mut flash) = (world(), Flash::new(6));
    let mut board = hanging(&world, |news| matches!(news, News::End(End::Failed(_))));
    board.serve(&world, &mut flash);
    let failed = board.ends().pop();
    let Some(End::Failed(ScannerError::Station(_) | ScannerError::LostSteps(_))) = failed else {
        panic!("{:?}", board.news);
    };
    let mut board = Board::new(600 * SECOND, is_finished);
    board.commands.push_back((SECOND, Command::Continue));
    board.serve(&world, &mut flash);
    assert_eq!(board.ends().last(), Some(&End::Finished));
    assert_eq!(
        board.reads(),
        4,
        "those that the arm has spoiled, and no other"
    );
}

/// A new scan starts over: another material may lie there.
#[test]
fn a_new_scan_after_a_failure_starts_over() {
    let world = world();
    let mut board = hanging(&world, is_finished);
    board.commands.push_back((300 * SECOND, Command::NewScan));
    board.serve(&world, &mut Flash::new(6));
    assert_eq!(board.ends().last(), Some(&End::Finished));
    let is_failed = |news: &News| matches!(news, News::End(End::Failed(_)));
    let mut scans = board.news.split(is_failed);
    let reads = |scan: &[News]| {
        let reads = scan.iter().filter(|news| matches!(news, News::Read { .. }));
        reads.count()
    };
    let (_, second) = (scans.next(), scans.next());
    assert_eq!(second.map(reads), Some(8));
    assert_eq!(scans.count(), 0, "no other failure");
}

/// Polls a button in rounds of a millisecond; `contact` is its state in each. Returns the commands and
/// their times.
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
fn a_short_press_is_a_new_scan_and_a_long_one_continues() {
    let short = press(10_000, |now| (1000..1300).contains(&now));
    assert_eq!(short, [(1320, Command::NewScan)]);
    let long = press(10_000, |now| (1000..5000).contains(&now));
    assert_eq!(long, [(3000, Command::Continue)], "once");
}

#[test]
fn a_bouncing_button_counts_once_and_a_glitch_not_at_all() {
    let bouncing = press(10_000, |now| match now {
        1000..1010 | 1300..1310 => now % 2 == 0,
        1010..1300 => true,
        _ => false,
    });
    assert_eq!(bouncing.len(), 1);
    assert_eq!(bouncing[0].1, Command::NewScan);
    assert_eq!(press(10_000, |now| (1000..1015).contains(&now)), []);
}

/// Wires that touch each other, or somebody who leans on it, do not start the arms.
#[test]
fn a_button_that_is_pressed_from_the_start_is_ignored_until_it_is_released() {
    assert_eq!(press(10_000, |_| true), []);
    assert_eq!(press(10_000, |now| now < 5000), []);
    let again = press(10_000, |now| now < 5000 || (6000..6500).contains(&now));
    assert_eq!(again, [(6520, Command::NewScan)]);
}

/// A caller that comes back after four seconds has not seen a long press.
#[test]
fn a_late_caller_makes_no_press_longer() {
    let mut button = Button::default();
    let contacts = [false, false, false, true, true, true, true];
    let commands = contacts.map(|contact| button.poll(contact, 4_000_000));
    assert_eq!(commands, [None; 7]);
}
