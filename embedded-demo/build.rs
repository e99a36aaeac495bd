//! Passes the chip's memory layout and the linker scripts to the linker, and generates the constants of
//! `src/recipe.rs`.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::{env, fs};

use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Recipe;

/// The recipe's file: the samples and the fit, as written by the trainer. For another recipe, of any model, change this
/// path or set the environment variable `GLIMPSE_RECIPE`. To train a recipe, from the repository's root: `cargo run
/// --release -- train --model neural --samples 8 --out embedded-demo/mine.recipe`
const RECIPE: &str = "../trainer/recipes/paper/neural-n8.recipe";
/// The memory layout; for another chip, its file.
const MEMORY: &str = "memory/stm32f405.x";

fn main() -> Result<(), Box<dyn Error>> {
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or("OUT_DIR is not set: build with cargo")?);
    println!("cargo::rerun-if-changed=build.rs");

    println!("cargo::rerun-if-env-changed=GLIMPSE_RECIPE");
    let recipe = env::var("GLIMPSE_RECIPE").unwrap_or_else(|_| RECIPE.to_owned());
    println!("cargo::rerun-if-changed={recipe}");
    fs::write(out.join("recipe.rs"), constants(Path::new(&recipe))?)?;

    println!("cargo::rerun-if-changed={MEMORY}");
    fs::copy(MEMORY, out.join("memory.x"))?;
    println!("cargo::rustc-link-search={}", out.display());
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
    println!("cargo::rustc-link-arg-bins=-Tdefmt.x");
    if env::var_os("CARGO_FEATURE_PROVE_NO_PANIC").is_some() {
        // defmt's default handler is always linked, and panics. Nothing calls it.
        println!("cargo::rustc-link-arg-bins=--defsym=__defmt_default_panic=Reset");
    }
    // Sections in flash need no padding to 64 KiB pages.
    println!("cargo::rustc-link-arg-bins=--nmagic");
    Ok(())
}

/// Returns the source of the constants that `src/recipe.rs` includes: the recipe and its model.
fn constants(path: &Path) -> Result<String, Box<dyn Error>> {
    let with_path = |error: &dyn Error| format!("{}: {error}", path.display());
    let path = fs::canonicalize(path).map_err(|error| with_path(&error))?;
    let bytes = fs::read(&path)?;
    let recipe = Recipe::parse(&bytes).map_err(|error| with_path(&error))?;
    let model = match recipe.model() {
        ModelKind::Phong => "model::Phong",
        ModelKind::CookTorrance => "model::CookTorrance",
        ModelKind::Neural => "model::Neural",
        ModelKind::Linear => "fit::Linear",
        model => {
            return Err(format!(
                "{}: the model {model} is unknown: update build.rs",
                path.display()
            )
            .into());
        }
    };
    Ok(format!(
        "/// The recipe, as written by the trainer.\n\
         pub static RECIPE: &[u8] = include_bytes!({path:?});\n\
         /// The model of the recipe.\n\
         pub type Model = glimpse_core::{model};\n"
    ))
}
