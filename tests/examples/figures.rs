//! Prints what the firmware costs: instructions of one fit, flash, static RAM and stack.

use glimpse_tests::elf::Firmware;
use glimpse_tests::emulator::Emulator;
use glimpse_trainer::material::Procedural;
use glimpse_trainer::scanner::{Options, ScannerError, VirtualScanner};

fn main() -> Result<(), ScannerError> {
    let firmware = Firmware::load();
    let mut emulator = Emulator::boot(&firmware, firmware.path());
    let material = Procedural::new(0, 0xFEED);
    VirtualScanner::new(&material, Options::default()).serve(&mut emulator.serial)?;

    let static_ram: u64 = [".data", ".bss", ".uninit"]
        .iter()
        .map(|section| firmware.section_bytes(section))
        .sum();
    let figure = |name, value| println!("thumbv7em-none-eabihf.neural.{name}={value}");
    figure("fit_instructions", emulator.wait_for("fit_instructions="));
    figure("text_bytes", firmware.section_bytes(".text").to_string());
    figure("static_ram_bytes", static_ram.to_string());
    figure("stack_bytes", emulator.wait_for("stack_bytes="));
    Ok(())
}
