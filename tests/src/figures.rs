//! What a fit costs on each kind of microcontroller, as `target.model.name` and a value.

use glimpse_core::model::ModelKind;
use glimpse_fits::recipes;

use crate::cycles;
use crate::microcontroller::{Binary, Functions, TARGETS};

/// All models.
pub const MODELS: [ModelKind; 4] = [
    ModelKind::Linear,
    ModelKind::Phong,
    ModelKind::CookTorrance,
    ModelKind::Neural,
];

fn recipe(model: ModelKind) -> &'static [u8] {
    match model {
        ModelKind::Phong => recipes::PHONG,
        ModelKind::CookTorrance => recipes::COOK_TORRANCE,
        ModelKind::Neural => recipes::NEURAL,
        ModelKind::Linear => recipes::LINEAR,
    }
}

/// Instructions of a fit as QEMU counts them (`fit_instructions`), its cycles by Arm's
/// [table](crate::cycles) where there is one (`fit_cycles`), bytes of code and constants
/// without the recipe (`text_bytes`: what the binary is larger than one that does nothing), of
/// statics (`static_ram_bytes`), and of the stack at its deepest (`stack_bytes`).
#[must_use]
pub fn figures() -> Vec<(String, u64)> {
    let mut figures = Vec::new();
    for target in TARGETS {
        for functions in [Functions::Libm, Functions::Micromath] {
            if functions == Functions::Micromath && target != TARGETS[0] {
                continue;
            }
            let flash = |name: &str| {
                Binary::new(target, functions, name).section_bytes(&[".text", ".rodata"])
            };
            for model in MODELS {
                let binary = Binary::new(target, functions, model.name());
                let output = binary.run();
                let suffix = match functions {
                    Functions::Libm => "",
                    Functions::Micromath => "-micromath",
                };
                let mut add = |name: &str, value| {
                    figures.push((format!("{}.{model}{suffix}.{name}", target.triple), value));
                };
                add("fit_instructions", output.count("fit_instructions"));
                if target.has_table_of_cycles() {
                    add("fit_cycles", cycles::of_fit(&binary).cycles);
                }
                let recipe = recipe(model).len() as u64;
                add(
                    "text_bytes",
                    flash(model.name()).saturating_sub(flash("nothing") + recipe),
                );
                let statics = binary.section_bytes(&[".data", ".bss", ".uninit"]);
                add("static_ram_bytes", statics);
                add("stack_bytes", output.count("stack_bytes"));
            }
        }
    }
    figures
}
