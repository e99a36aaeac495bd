//! Costs of fits on each kind of microcontroller, and of the demo firmware. Each has a name `target.fit.figure` and a
//! value.

use glimpse_bench::recipes;

use crate::cycles::fit_cycles;
use crate::emulator::Emulator;
use crate::host::{noiseless_scanner, unseen_material};
use crate::microcontroller::{BOARD, Binary, MathLibrary, TARGETS, Target};

/// A measured fit: a binary of `embedded-demo/bench`.
#[derive(Clone, Copy, Debug)]
pub struct FitBinary {
    /// The binary's name.
    pub name: &'static str,
    /// The recipe of the fit.
    pub recipe: &'static [u8],
}

/// The extent of a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// The four models on the board's target with libm, without cycles: what `tests/run firmware` builds.
    Board,
    /// All recipes, targets and libraries: what `tests/run targets` builds.
    All,
}

/// One fit, with all stages of an estimator, represents all of them on other targets than the board's.
const FOR_ALL_TARGETS: &str = "neural-completed";

impl FitBinary {
    const fn new(name: &'static str, recipe: &'static [u8]) -> Self {
        Self { name, recipe }
    }

    /// Returns true if it is built for this target with this library.
    #[must_use]
    pub fn is_built(&self, extent: Extent, target: Target, library: MathLibrary) -> bool {
        let is_board = target == BOARD;
        let is_model = ["linear", "phong", "cook-torrance", "neural"].contains(&self.name);
        match (extent, library) {
            (Extent::Board, MathLibrary::Libm) | (Extent::All, MathLibrary::Micromath) => {
                is_board && is_model
            }
            (Extent::Board, MathLibrary::Micromath) => false,
            (Extent::All, MathLibrary::Libm) => is_board || self.name == FOR_ALL_TARGETS,
        }
    }
}

/// All measured fits.
pub const FIT_BINARIES: [FitBinary; 14] = [
    FitBinary::new("linear", recipes::LINEAR),
    FitBinary::new("phong", recipes::PHONG),
    FitBinary::new("cook-torrance", recipes::COOK_TORRANCE),
    FitBinary::new("neural", recipes::NEURAL),
    FitBinary::new("linear-completed", recipes::COMPLETED_LINEAR),
    FitBinary::new("phong-completed", recipes::COMPLETED_PHONG),
    FitBinary::new("cook-torrance-completed", recipes::COMPLETED_COOK_TORRANCE),
    FitBinary::new("neural-completed", recipes::COMPLETED_NEURAL),
    FitBinary::new("linear-masked", recipes::MASKED_LINEAR),
    FitBinary::new("neural-masked", recipes::MASKED_NEURAL),
    FitBinary::new("linear-n64", recipes::LINEAR_64),
    FitBinary::new("neural-n64", recipes::NEURAL_64),
    FitBinary::new("linear-basis", recipes::COMPLETED_LINEAR),
    FitBinary::new("any", recipes::NEURAL),
];

/// Calls of the counter's function after a fit: before and after the evaluation of a BRDF.
const CALLS_AFTER_FIT: usize = 2;

/// Measures fits. The figures of a fit are:
///
/// - `parse_instructions`, `basis_parse_instructions`, `brdf_instructions`: instructions of parsing the recipe, of
///   parsing the basis, and of one evaluation of the BRDF;
/// - `fit_instructions`: instructions of the fit, counted by QEMU;
/// - `fit_cycles`: cycles of the fit from Arm's [table](crate::cycles), if there is one for the target;
/// - `text_bytes`: code and constants without recipe and basis, minus those of a binary that does nothing;
/// - `static_ram_bytes`: statics;
/// - `stack_bytes`: the largest depth of the stack.
#[must_use]
pub fn figures(extent: Extent) -> Vec<(String, u64)> {
    let mut figures = Vec::new();
    for target in TARGETS {
        for library in [MathLibrary::Libm, MathLibrary::Micromath] {
            let flash = |name: &str| {
                Binary::new(target, library, name).section_bytes(&[".text", ".rodata"])
            };
            let built = |fit: &&FitBinary| fit.is_built(extent, target, library);
            for fit in FIT_BINARIES.iter().filter(built) {
                let binary = Binary::new(target, library, fit.name);
                let output = binary.run();
                let suffix = match library {
                    MathLibrary::Libm => "",
                    MathLibrary::Micromath => "-micromath",
                };
                let row = format!("{}.{}{suffix}", target.triple, fit.name);
                let mut add = |name, value| figures.push((format!("{row}.{name}"), value));
                for name in [
                    "parse_instructions",
                    "basis_parse_instructions",
                    "brdf_instructions",
                    "fit_instructions",
                ] {
                    if let Some(value) = output.get(name) {
                        add(name, value);
                    }
                }
                if extent == Extent::All && target == BOARD {
                    add("fit_cycles", fit_cycles(&binary, CALLS_AFTER_FIT));
                }
                let basis = output.get("basis_parse_instructions");
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

/// Measures the complete firmware of `embedded-demo` with a scan in QEMU.
///
/// # Panics
/// If the firmware is not built, or the scan fails.
#[must_use]
pub fn demo_figures() -> Vec<(String, u64)> {
    let (firmware, mut emulator) = (Binary::demo(), Emulator::boot());
    noiseless_scanner(&unseen_material(0))
        .serve(&mut emulator.serial)
        .expect("a scan");
    let logged = |name: &str| -> u64 {
        let value = emulator.wait_for(&format!("{name}="));
        value.parse().expect("a number")
    };
    let static_ram = firmware.section_bytes(&[".data", ".bss", ".uninit"]);
    let figures = [
        ("fit_instructions", logged("fit_instructions")),
        ("text_bytes", firmware.section_bytes(&[".text"])),
        ("static_ram_bytes", static_ram),
        ("stack_bytes", logged("stack_bytes")),
    ];
    figures
        .map(|(name, value)| (format!("thumbv7em-none-eabihf.demo.{name}"), value))
        .into()
}
