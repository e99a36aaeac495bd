//! Bad days of the firmware, in QEMU. Each ends in a completed scan or in an error by name: never
//! in silence, and never in a wrong result.

mod host;
mod line;
mod recipe;
mod reset;
mod sensor;
mod time;

use glimpse_tests::RECIPE;
use glimpse_tests::device::assert_agrees;
use glimpse_tests::emulator::Emulator;
use glimpse_tests::host::{scanner, unseen};

/// After all that, a good scanner gets a whole and right scan.
fn assert_scans(emulator: &mut Emulator) {
    let material = unseen(1);
    let report = scanner(&material).serve(&mut emulator.serial).unwrap();
    assert_agrees(&report, RECIPE);
}
