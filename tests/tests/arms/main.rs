//! The firmware that moves the arms itself, in QEMU, on a simulated scanner: its arms see edges on
//! their pins only, and its sensor sees the sample from where they are.

mod host;
mod log;

use std::io::Write;

use glimpse_core::model::Neural;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Scan;
use glimpse_tests::RECIPE;
use glimpse_tests::elf::Firmware;
use glimpse_tests::emulator::Emulator;
use log::{
    FINISHED, NEW_RECIPE, NO_HOST, RESUMED, SAVED, Taken, indices, lost_steps, readings, values,
};

/// Bytes that press the button, while the firmware asks about saved readings.
const NEW_SCAN: u8 = b'p';
const CONTINUE: u8 = b'h';

fn boot() -> Emulator {
    let firmware = Firmware::load_arms();
    Emulator::boot(&firmware, firmware.path())
}

/// What the host makes of the last reading of each sample.
fn fit(readings: &[Taken]) -> Vec<u32> {
    let recipe = Recipe::parse(RECIPE).unwrap();
    let mut memory = vec![0.0; recipe.memory_words()];
    let mut scan = Scan::<Neural>::new(recipe, &mut memory).unwrap();
    for taken in readings {
        scan.record(taken.index, taken.reading).unwrap();
    }
    let mut fit = scan.fit().unwrap();
    while !fit.advance(u32::MAX).is_complete() {}
    let fitted = fit.finish().unwrap();
    fitted.values().map(f32::to_bits).collect()
}

/// Each sample was read once, no step was lost, and the values have the bits of the host's fit.
fn assert_whole(log: &[String]) {
    let readings = readings(log);
    let mut read = indices(&readings);
    read.sort_unstable();
    assert_eq!(read, [0, 1, 2, 3, 4, 5, 6, 7]);
    assert_eq!(values(log), fit(&readings));
    assert!(lost_steps(log).is_empty());
}

#[test]
fn a_scan_ends_in_the_bits_of_the_hosts_fit() {
    let emulator = boot();
    let _ = emulator.wait_for(FINISHED);
    assert_whole(&emulator.log());
}

/// Resets the firmware, and gives this command once it asks about saved readings.
fn reset_and_command(emulator: &mut Emulator, command: u8) {
    let questions = |log: &[String]| {
        let is_question = |line: &&String| line.starts_with(SAVED);
        log.iter().filter(is_question).count()
    };
    let before = questions(&emulator.log());
    emulator.reset();
    emulator.wait_until(|log| questions(log) > before);
    emulator.serial.write_all(&[command]).unwrap();
}

/// Resets after the second, fourth and seventh reading; the arms and the flash are left as they are. Each time
/// somebody confirms that the same material is there.
#[test]
fn resets_measure_nothing_twice() {
    let mut emulator = boot();
    for count in [2, 4, 7] {
        emulator.wait_until(|log| readings(log).len() >= count);
        reset_and_command(&mut emulator, CONTINUE);
    }
    let _ = emulator.wait_for(FINISHED);
    let log = emulator.log();
    assert_whole(&log);
    let resumed = log.iter().filter(|line| line.starts_with(RESUMED));
    assert!(resumed.count() >= 3);
}

/// After a reset the firmware asks and waits, so another material may be put there.
#[test]
fn a_new_material_after_a_reset_is_read_from_the_first_sample() {
    let mut emulator = boot();
    emulator.wait_until(|log| readings(log).len() >= 5);
    reset_and_command(&mut emulator, NEW_SCAN);
    let _ = emulator.wait_for(FINISHED);
    let log = emulator.log();
    let question = log.iter().rposition(|line| line.starts_with(SAVED));
    let (_, after) = log.split_at(question.unwrap());
    assert_whole(after);
    assert!(!log.iter().any(|line| line.starts_with(RESUMED)));
}

/// The sensor's azimuth loses forty steps: its home switch tells, and what was read meanwhile is read
/// again.
#[test]
fn lost_steps_are_found_by_name_and_what_they_spoilt_is_read_again() {
    let mut emulator = boot();
    let _ = emulator.wait_for(NO_HOST);
    emulator.wait_until(|log| !readings(log).is_empty());
    emulator.serial.write_all(b"d").unwrap();
    let _ = emulator.wait_for(FINISHED);
    let log = emulator.log();
    let lost = lost_steps(&log);
    assert_eq!(lost.len(), 1, "{lost:?}");
    let [arm, steps] = lost[0][..] else {
        panic!("{lost:?}")
    };
    assert_eq!((arm, steps.abs()), (3, 40));
    let readings = readings(&log);
    assert!(readings.len() > 8);
    // What is read after the loss was found is what the fit is of.
    assert_eq!(values(&log), fit(&readings));
}

/// A recipe comes over the link, and a reset in the middle of it leaves the old one.
#[test]
fn a_recipe_is_replaced_over_the_link_and_halfway_leaves_the_old_one() {
    let mut emulator = boot();
    let old = Recipe::parse(RECIPE).unwrap().checksum();
    let other = glimpse_bench::recipes::PHONG;
    let new = Recipe::parse(other).unwrap().checksum();

    let hello = host::offer(&mut emulator.serial, other, other.len() / 2);
    assert_eq!(hello, old);
    emulator.reset();
    let hello = host::offer(&mut emulator.serial, other, usize::MAX);
    assert_eq!(hello, old, "half a recipe is none");
    let _ = emulator.wait_for(NEW_RECIPE);
    assert_eq!(host::greet(&mut emulator.serial), new);
    emulator.reset();
    assert_eq!(
        host::greet(&mut emulator.serial),
        new,
        "it outlasts a reset"
    );
}

/// Sizes of the board's build, which is compiled and not run.
#[test]
fn the_boards_firmware_is_there_and_has_its_size() {
    let firmware = Firmware::load_arms_board();
    let text = firmware.section_bytes(".text") + firmware.section_bytes(".rodata");
    let ram = firmware.section_bytes(".data") + firmware.section_bytes(".bss");
    println!("arms-board.text_bytes={text}\narms-board.static_ram_bytes={ram}");
    // Safe paths, checks of the switches, and skipped samples take 7 KiB of these.
    assert!((20_000..106 * 1024).contains(&text), "{text}");
    assert!((10_000..64 * 1024).contains(&ram), "{ram}");
}
