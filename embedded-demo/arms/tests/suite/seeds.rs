//! Sequence numbers on the link are not repeated by later drivers.

use std::collections::HashSet;

use crate::board::{Host, SECOND, TestBoard, answer, simulated};
use crate::support::{CUT_EFFECTS, Flash, mount_readings};
use glimpse_core::scan::Reading;

/// The first frame differs in each boot.
#[test]
fn reset_changes_sequence_numbers() {
    let mut flash = Flash::new(6);
    let mut frames = HashSet::new();
    for _ in 0..20 {
        let mut board = TestBoard::new(SECOND / 10, |_| false);
        board.host = Some(Host::new(|request| Some(answer(request, None))));
        board.serve(&simulated(), &mut flash);
        let mut frames_sent = board.sent.split(|byte| *byte == 0);
        let first = frames_sent.find(|frame| !frame.is_empty());
        let frame = first.unwrap().to_vec();
        assert!(frames.insert(frame), "the same bytes after a reset");
    }
}

/// Drivers of one boot differ, too: a waiting device greets its host every two seconds.
#[test]
fn each_greeting_has_new_sequence_numbers() {
    let mut board = TestBoard::new(20 * SECOND, |_| false);
    board.host = Some(Host::new(|request| Some(answer(request, None))));
    board.serve(&simulated(), &mut Flash::new(6));
    let greetings: Vec<_> = board
        .sent
        .split(|byte| *byte == 0)
        .filter(|frame| !frame.is_empty())
        .collect();
    let different: HashSet<_> = greetings.iter().collect();
    assert!(greetings.len() > 9);
    assert_eq!(different.len(), greetings.len());
}

/// The boot counter shares the journal with the readings, which moves between its areas.
#[test]
fn boot_count_survives_journal_compaction() {
    let mut flash: Flash = Flash::new(6);
    for boot in 1..100 {
        let mut readings = mount_readings(&mut flash);
        assert_eq!(readings.count_boot(&mut flash), Ok(boot));
        if boot == 1 {
            readings.begin_scan(&mut flash, 7, 8).unwrap();
        }
        let index = (boot % 8) as u16;
        let reading = Reading::new([boot as f32; 3]);
        readings.save(&mut flash, index, reading).unwrap();
        assert_eq!(readings.get(&mut flash, index), Ok(Some(reading)));
    }
}

/// A power cut during the count leaves the count before or after it. No driver has used either.
#[test]
fn power_cut_does_not_decrease_boot_count() {
    for effect in CUT_EFFECTS {
        let mut flash: Flash = Flash::new(6);
        for boot in 1..40 {
            let mut readings = mount_readings(&mut flash);
            flash.cut = Some((1, effect));
            let counted = readings.count_boot(&mut flash);
            assert!(counted.is_err());
            flash.cut = None;
            let count = mount_readings(&mut flash).count_boot(&mut flash).unwrap();
            assert!(count >= boot, "{count} at boot {boot}, {effect:?}");
        }
    }
}
