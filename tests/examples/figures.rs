//! Prints what a fit costs on each kind of microcontroller, and the whole firmware of
//! `embedded-demo`: instructions and cycles of one fit, flash, static RAM and stack. With `--table` it
//! prints the fits as `core/docs/costs.md` shows them.

use glimpse_tests::elf::Firmware;
use glimpse_tests::emulator::Emulator;
use glimpse_tests::figures::figures;
use glimpse_trainer::material::Procedural;
use glimpse_trainer::scanner::{ScannerError, ScannerNoise, VirtualScanner};

fn main() -> Result<(), ScannerError> {
    let figures = figures();
    if std::env::args().any(|argument| argument == "--table") {
        print_table(&figures);
        return Ok(());
    }
    for (name, value) in figures {
        println!("{name}={value}");
    }

    let firmware = Firmware::load();
    let mut emulator = Emulator::boot(&firmware, firmware.path());
    let material = Procedural::new(0, 0xFEED);
    VirtualScanner::new(&material, ScannerNoise::default()).serve(&mut emulator.serial)?;

    let static_ram: u64 = [".data", ".bss", ".uninit"]
        .iter()
        .map(|section| firmware.section_bytes(section))
        .sum();
    let figure = |name, value| println!("thumbv7em-none-eabihf.demo.{name}={value}");
    figure("fit_instructions", emulator.wait_for("fit_instructions="));
    figure("text_bytes", firmware.section_bytes(".text").to_string());
    figure("static_ram_bytes", static_ram.to_string());
    figure("stack_bytes", emulator.wait_for("stack_bytes="));
    Ok(())
}

/// The document's table: a row for each target and model, a column for each figure.
fn print_table(figures: &[(String, u64)]) {
    println!("| target | model | instructions of a fit | cycles | flash | static RAM | stack |");
    println!("|---|---|---|---|---|---|---|");
    for row in figures.chunk_by(|(a, _), (b, _)| row_of(a) == row_of(b)) {
        let name = row.first().map_or("", |(name, _)| row_of(name));
        let cell = |figure: &str| {
            let found = row.iter().find(|(name, _)| name.ends_with(figure));
            found.map(|(_, value)| grouped(*value)).unwrap_or_default()
        };
        let figures = [
            "fit_instructions",
            "fit_cycles",
            "text_bytes",
            "static_ram_bytes",
            "stack_bytes",
        ];
        println!(
            "| {} | {} |",
            name.replace('.', " | "),
            figures.map(cell).join(" | ")
        );
    }
}

/// What precedes a figure's name: target and model.
fn row_of(name: &str) -> &str {
    name.rsplit_once('.').map_or("", |(row, _)| row)
}

/// Digits in groups of three.
fn grouped(value: u64) -> String {
    let digits = value.to_string();
    let groups = digits.as_bytes().rchunks(3).rev();
    let groups: Vec<_> = groups.map(String::from_utf8_lossy).collect();
    groups.join(",")
}
