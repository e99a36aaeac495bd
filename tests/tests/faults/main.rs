//! Faults of the firmware's environment, in QEMU. Each ends in a complete scan or a named error, never in silence or a
//! wrong result.

mod host;
mod line;
mod recipe;
mod reset;
mod sensor;
mod time;

use glimpse_tests::RECIPE;
use glimpse_tests::device::assert_matches_host;
use glimpse_tests::emulator::Emulator;
use glimpse_tests::host::{noiseless_scanner, unseen_material};

/// Checks that a scanner without faults receives a complete and correct scan.
fn assert_scans(emulator: &mut Emulator) {
    let material = unseen_material(1);
    let report = noiseless_scanner(&material)
        .serve(&mut emulator.serial)
        .unwrap();
    assert_matches_host(&report, RECIPE);
}
