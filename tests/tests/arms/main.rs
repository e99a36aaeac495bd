//! The motion firmware in QEMU, with a simulated scanner: its arms react only to edges on their pins, and its sensor
//! reads the sample from their positions.

mod host;
mod log;

use std::io::Write;

use glimpse_core::fit::AnyModel;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Scan;
use glimpse_tests::RECIPE;
use glimpse_tests::elf::Firmware;
use glimpse_tests::emulator::Emulator;
use glimpse_trainer::bundled;
use log::{
    FINISHED, LoggedReading, NEW_RECIPE, NO_HOST, RESUMED, SAVED, indices, lost_steps, readings,
    values,
};

/// Bytes on the serial line that begin or continue a scan, as the button does on a board.
const NEW_SCAN: u8 = b'p';
const CONTINUE: u8 = b'h';

fn boot() -> Emulator {
    let firmware = Firmware::load_arms();
    Emulator::boot(&firmware, firmware.path())
}

/// Returns the host's fit of the last reading of each sample.
fn fit(recipe: &[u8], readings: &[LoggedReading]) -> Vec<u32> {
    let recipe = Recipe::parse(recipe).unwrap();
    let mut memory = vec![0.0; recipe.memory_words()];
    let mut scan = Scan::<AnyModel>::new(recipe, &mut memory).unwrap();
    for LoggedReading { index, reading } in readings {
        scan.record(*index, *reading).unwrap();
    }
    let mut fit = scan.fit().unwrap();
    while !fit.advance(u32::MAX).is_complete() {}
    let fitted = fit.finish().unwrap();
    fitted.values().map(f32::to_bits).collect()
}

/// Checks that each sample was read once, that no step was lost, and that the values equal the host's fit bit for bit.
fn assert_complete_scan(log: &[String]) {
    let readings = readings(log);
    let mut samples = indices(&readings);
    samples.sort_unstable();
    assert_eq!(samples, [0, 1, 2, 3, 4, 5, 6, 7]);
    assert_eq!(values(log), fit(RECIPE, &readings));
    assert!(lost_steps(log).is_empty());
}

#[test]
fn scan_matches_host_fit_bit_for_bit() {
    let emulator = boot();
    let _ = emulator.wait_for(FINISHED);
    assert_complete_scan(&emulator.log());
}

/// Resets the firmware, and sends a command when it asks about saved readings.
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

/// Resets after the second, fourth and seventh reading. The arms and the flash keep their state. The answer to each
/// question confirms that the material is the same.
#[test]
fn resets_repeat_no_reading() {
    let mut emulator = boot();
    for count in [2, 4, 7] {
        emulator.wait_until(|log| readings(log).len() >= count);
        reset_and_command(&mut emulator, CONTINUE);
    }
    let _ = emulator.wait_for(FINISHED);
    let log = emulator.log();
    assert_complete_scan(&log);
    let resumed = log.iter().filter(|line| line.starts_with(RESUMED));
    assert!(resumed.count() >= 3);
}

/// After a reset, the firmware asks and waits, so the material may be replaced.
#[test]
fn new_material_after_reset_is_measured_completely() {
    let mut emulator = boot();
    emulator.wait_until(|log| readings(log).len() >= 5);
    reset_and_command(&mut emulator, NEW_SCAN);
    let _ = emulator.wait_for(FINISHED);
    let log = emulator.log();
    let question = log.iter().rposition(|line| line.starts_with(SAVED));
    let (_, new_scan) = log.split_at(question.unwrap());
    assert_complete_scan(new_scan);
    assert!(!log.iter().any(|line| line.starts_with(RESUMED)));
}

/// The sensor's azimuth loses 40 steps. Its home switch reveals it, and the affected samples are read again.
#[test]
fn lost_steps_are_reported_and_affected_samples_are_read_again() {
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
    // The fit uses the readings after the loss was detected.
    assert_eq!(values(&log), fit(RECIPE, &readings));
}

/// The link transfers a new recipe. A reset during the transfer keeps the old one.
#[test]
fn link_replaces_recipe_and_incomplete_transfer_keeps_old_one() {
    let mut emulator = boot();
    let old_checksum = Recipe::parse(RECIPE).unwrap().checksum();
    let new_recipe = glimpse_bench::recipes::PHONG;
    let new_checksum = Recipe::parse(new_recipe).unwrap().checksum();

    let current = host::offer(&mut emulator.serial, new_recipe, new_recipe.len() / 2);
    assert_eq!(current, old_checksum);
    emulator.reset();
    let current = host::offer(&mut emulator.serial, new_recipe, usize::MAX);
    assert_eq!(
        current, old_checksum,
        "an incomplete transfer replaced the recipe"
    );
    let _ = emulator.wait_for(NEW_RECIPE);
    assert_eq!(host::receive_hello(&mut emulator.serial), new_checksum);
    emulator.reset();
    assert_eq!(
        host::receive_hello(&mut emulator.serial),
        new_checksum,
        "a reset removed the new recipe"
    );
}

/// A recipe that was trained for the seconds of a scan is read in its own order.
#[test]
fn timed_recipe_is_read_in_its_order() {
    let timed = bundled::ALL
        .iter()
        .find(|bundled| bundled.name == "linear-n16-16s");
    let recipe = timed.unwrap().bytes;
    let mut emulator = boot();
    host::offer(&mut emulator.serial, recipe, usize::MAX);
    let _ = emulator.wait_for(NEW_RECIPE);
    emulator.serial.write_all(&[NEW_SCAN]).unwrap();
    let _ = emulator.wait_for(FINISHED);
    let log = emulator.log();
    let start = log.iter().rposition(|line| line.starts_with(NEW_RECIPE));
    let (_, scan) = log.split_at(start.unwrap());
    let readings = readings(scan);
    assert!(indices(&readings).into_iter().eq(0..16));
    assert_eq!(values(scan), fit(recipe, &readings));
}

/// Checks the sizes of the build for the board. Tests do not run this build.
#[test]
fn board_firmware_has_expected_size() {
    let firmware = Firmware::load_arms_board();
    let text = firmware.section_bytes(".text") + firmware.section_bytes(".rodata");
    let ram = firmware.section_bytes(".data") + firmware.section_bytes(".bss");
    println!("arms-board.text_bytes={text}\narms-board.static_ram_bytes={ram}");
    // Safe paths, checks of the switches, and skipped samples take 7 KiB of the text; corrections and Gauss-Newton steps
    // of all models take 12, and bounds of partial scans 2.
    assert!((20_000..121 * 1024).contains(&text), "{text}");
    assert!((10_000..64 * 1024).contains(&ram), "{ram}");
}
