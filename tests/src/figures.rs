//! Costs of fits on each kind of microcontroller and of the demo firmware, as `target.fit.name` and a value.

use glimpse_bench::recipes::{self, completed, large, masked};

use glimpse_trainer::scanner::{ScannerNoise, VirtualScanner};

use crate::cycles;
use crate::elf::Firmware;
use crate::emulator::Emulator;
use crate::host::unseen;
use crate::microcontroller::{Binary, Functions, TARGETS, Target};

/// A fit that is tried: a binary of `embedded-demo/bench`.
#[derive(Clone, Copy, Debug)]
pub struct Fit {
    /// The binary's name.
    pub name: &'static str,
    /// The recipe that it fits by.
    pub recipe: &'static [u8],
    /// Where it is built.
    reach: Reach,
}

/// Where a fit is built. What the rest would tell is told by those that are built everywhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reach {
    /// For every target, and for the board's with micromath too.
    All,
    /// For every target.
    Targets,
    /// For the board's target.
    Board,
}

impl Fit {
    const fn new(name: &'static str, recipe: &'static [u8], reach: Reach) -> Self {
        Self {
            name,
            recipe,
            reach,
        }
    }

    /// Whether `tests/run firmware` builds it so.
    #[must_use]
    pub fn is_built(&self, target: Target, functions: Functions) -> bool {
        let is_board = target == TARGETS[0];
        match functions {
            Functions::Libm => is_board || self.reach != Reach::Board,
            Functions::Micromath => is_board && self.reach == Reach::All,
        }
    }
}

/// All of them.
pub const FITS: [Fit; 16] = [
    Fit::new("linear", recipes::LINEAR, Reach::All),
    Fit::new("phong", recipes::PHONG, Reach::All),
    Fit::new("cook-torrance", recipes::COOK_TORRANCE, Reach::All),
    Fit::new("neural", recipes::NEURAL, Reach::All),
    Fit::new("linear-completed", completed::LINEAR, Reach::Targets),
    Fit::new("phong-completed", completed::PHONG, Reach::Board),
    Fit::new(
        "cook-torrance-completed",
        completed::COOK_TORRANCE,
        Reach::Board,
    ),
    Fit::new("neural-completed", completed::NEURAL, Reach::Targets),
    Fit::new("linear-masked", masked::LINEAR, Reach::Board),
    Fit::new("neural-masked", masked::NEURAL, Reach::Board),
    Fit::new("linear-n32", large::LINEAR_32, Reach::Board),
    Fit::new("linear-n64", large::LINEAR_64, Reach::Board),
    Fit::new("neural-n32", large::NEURAL_32, Reach::Board),
    Fit::new("neural-n64", large::NEURAL_64, Reach::Board),
    Fit::new("linear-basis", completed::LINEAR, Reach::Board),
    Fit::new("any", recipes::NEURAL, Reach::Board),
];

/// Readings of the counter behind those of a fit: before and after a BRDF.
pub const BRDF_READINGS: usize = 2;

/// Instructions of parsing a recipe (`parse_instructions`) or a basis (`basis_parse_instructions`), and of evaluating the
/// BRDF once (`brdf_instructions`); instructions of a fit as QEMU counts them (`fit_instructions`), its cycles by Arm's
/// [table](crate::cycles) where there is one (`fit_cycles`), bytes of code and constants
/// without recipe and basis (`text_bytes`: what the binary is larger than one that does nothing), of
/// statics (`static_ram_bytes`), and of the stack at its deepest (`stack_bytes`).
#[must_use]
pub fn figures() -> Vec<(String, u64)> {
    let mut figures = Vec::new();
    for target in TARGETS {
        for functions in [Functions::Libm, Functions::Micromath] {
            let flash = |name: &str| {
                Binary::new(target, functions, name).section_bytes(&[".text", ".rodata"])
            };
            for fit in FITS.iter().filter(|fit| fit.is_built(target, functions)) {
                let binary = Binary::new(target, functions, fit.name);
                let output = binary.run();
                let suffix = match functions {
                    Functions::Libm => "",
                    Functions::Micromath => "-micromath",
                };
                let row = format!("{}.{}{suffix}", target.triple, fit.name);
                let mut add = |name, value| figures.push((format!("{row}.{name}"), value));
                for name in [
                    "parse_instructions",
                    "basis_parse_instructions",
                    "brdf_instructions",
                    "fit_instructions",
                ] {
                    if let Some(value) = output.found(name) {
                        add(name, value);
                    }
                }
                if target.has_table_of_cycles() {
                    add("fit_cycles", cycles::of_fit(&binary, BRDF_READINGS).cycles);
                }
                let basis = output.found("basis_parse_instructions");
                let basis = basis.map_or(0, |_| recipes::BASIS.len());
                let data = (fit.recipe.len() + basis) as u64;
                add(
                    "text_bytes",
                    flash(fit.name).saturating_sub(flash("nothing") + data),
                );
                let statics = binary.section_bytes(&[".data", ".bss", ".uninit"]);
                add("static_ram_bytes", statics);
                add("stack_bytes", output.count("stack_bytes"));
            }
        }
    }
    figures
}

/// Costs of the whole firmware of `embedded-demo`, from a scan in QEMU.
///
/// # Panics
/// If the firmware is not built, or does not scan.
#[must_use]
pub fn demo_figures() -> Vec<(String, u64)> {
    let firmware = Firmware::load();
    let mut emulator = Emulator::boot(&firmware, firmware.path());
    VirtualScanner::new(&unseen(0), ScannerNoise::default())
        .serve(&mut emulator.serial)
        .expect("a scan");
    let logged = |name: &str| -> u64 {
        let value = emulator.wait_for(&format!("{name}="));
        value.parse().expect("a number")
    };
    let static_ram = [".data", ".bss", ".uninit"].map(|section| firmware.section_bytes(section));
    let figures = [
        ("fit_instructions", logged("fit_instructions")),
        ("text_bytes", firmware.section_bytes(".text")),
        ("static_ram_bytes", static_ram.iter().sum()),
        ("stack_bytes", logged("stack_bytes")),
    ];
    figures
        .map(|(name, value)| (format!("thumbv7em-none-eabihf.demo.{name}"), value))
        .into()
}
