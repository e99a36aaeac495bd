//! Sequence numbers on the link: a driver does not repeat those of the drivers before it.

use std::collections::HashSet;

use crate::bench::{Board, Host, SECOND, answer, world};
use crate::support::{Flash, LEAVES, mount_readings};
use glimpse_core::scan::Reading;

/// The first frame of each boot.
#[test]
fn a_reset_changes_the_sequence_numbers() {
    let mut flash = Flash::new(6);
    let mut frames = HashSet::new();
    for _ in 0..20 {
        let mut board = Board::new(SECOND / 10, |_| false);
        board.host = Some(Host::new(|request| Some(answer(request, None))));
        board.serve(&world(), &mut flash);
        let mut frames_sent = board.sent.split(|byte| *byte == 0);
        let first = frames_sent.find(|frame| !frame.is_empty());
        let frame = first.unwrap().to_vec();
        assert!(frames.insert(frame), "the same bytes after a reset");
    }
}

/// Drivers of one boot differ, too: a device that waits greets its host every two seconds.
#[test]
fn each_greeting_has_other_sequence_numbers() {
    let mut board = Board::new(20 * SECOND, |_| false);
    board.host = Some(Host::new(|request| Some(answer(request, None))));
    board.serve(&world(), &mut Flash::new(6));
    let greetings: Vec<_> = board
        .sent
        .split(|byte| *byte == 0)
        .filter(|frame| !frame.is_empty())
        .collect();
    let different: HashSet<_> = greetings.iter().collect();
    assert!(greetings.len() > 9);
    assert_eq!(different.len(), greetings.len());
}

/// Boots are counted beside readings, whose journal moves from one area to the other meanwhile.
#[test]
fn boots_are_counted_across_areas_of_the_flash() {
    let mut flash: Flash = Flash::new(6);
    for boot in 1..100 {
        let mut readings = mount_readings(&mut flash);
        assert_eq!(readings.count_boot(&mut flash), Ok(boot));
        if boot == 1 {
            readings.begin(&mut flash, 7, 8).unwrap();
        }
        let index = (boot % 8) as u16;
        let reading = Reading::new([boot as f32; 3]);
        readings.keep(&mut flash, index, reading).unwrap();
        assert_eq!(readings.get(&mut flash, index), Ok(Some(reading)));
    }
}

/// A power cut while a boot is counted leaves the count from before it or after it. No driver has used either.
#[test]
fn a_power_cut_does_not_set_the_boot_counter_back() {
    for leaves in LEAVES {
        let mut flash: Flash = Flash::new(6);
        for boot in 1..40 {
            let mut readings = mount_readings(&mut flash);
            flash.cut = Some((1, leaves));
            let counted = readings.count_boot(&mut flash);
            assert!(counted.is_err());
            flash.cut = None;
            let count = mount_readings(&mut flash).count_boot(&mut flash).unwrap();
            assert!(count >= boot, "{count} at boot {boot}, {leaves:?}");
        }
    }
}
