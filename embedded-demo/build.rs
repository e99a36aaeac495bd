//! Puts the chip's memory where the linker looks for `memory.x`, names the linker scripts, and
//! reads in the recipe which model is fitted.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::{env, fs};

use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Recipe;

/// What to measure and how to fit it, as the trainer wrote it. For another recipe, of any model,
/// name its file here (or in the environment, as `GLIMPSE_RECIPE`). To train one, from the
/// repository's root:
/// `cargo run --release -- train --model neural --samples 8 --out trainer/recipes/neural-n8.recipe`
const RECIPE: &str = "../trainer/recipes/neural-n8.recipe";
/// For another chip name its file here.
const MEMORY: &str = "memory/stm32f405.x";

fn main() -> Result<(), Box<dyn Error>> {
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or("cargo runs this")?);
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
    // Addresses of sections in flash need no padding to 64 KiB pages.
    println!("cargo::rustc-link-arg-bins=--nmagic");
    Ok(())
}

/// The recipe and its model, as `src/recipe.rs` includes them.
fn constants(path: &Path) -> Result<String, Box<dyn Error>> {
    let refused = |error: &dyn Error| format!("{}: {error}", path.display());
    let path = fs::canonicalize(path).map_err(|error| refused(&error))?;
    let bytes = fs::read(&path)?;
    let recipe = Recipe::parse(&bytes).map_err(|error| refused(&error))?;
    let model = match recipe.model() {
        ModelKind::Phong => "model::Phong",
        ModelKind::CookTorrance => "model::CookTorrance",
        ModelKind::Neural => "model::Neural",
        ModelKind::Linear => "fit::Linear",
        model => return Err(format!("{}: the model {model} is unknown", path.display()).into()),
    };
    Ok(format!(
        "/// The recipe, as the trainer wrote it.\n\
         pub static RECIPE: &[u8] = include_bytes!({path:?});\n\
         /// The model that it is for.\n\
         pub type Model = glimpse_core::{model};\n"
    ))
}
