//! Fits on the host, whose bits the board must reproduce, and passes linker scripts.

use std::path::PathBuf;
use std::{env, error, fs};

use glimpse_bench::{measure, recipes};
use glimpse_core::fit::AnyModel;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Scan;

fn main() -> Result<(), Box<dyn error::Error>> {
    let out = PathBuf::from(env::var("OUT_DIR")?);
    let mut constants = String::new();
    for (name, recipe) in [
        ("PHONG", recipes::COMPLETED_PHONG),
        ("COOK_TORRANCE", recipes::COMPLETED_COOK_TORRANCE),
        ("NEURAL", recipes::COMPLETED_NEURAL),
        ("LINEAR", recipes::COMPLETED_LINEAR),
    ] {
        let recipe = Recipe::parse(recipe)?;
        let mut memory = vec![0.0; recipe.memory_words()];
        let mut scan = Scan::<AnyModel>::new(recipe, &mut memory)?;
        for (index, angles) in (0..).zip(recipe.pattern()) {
            scan.record(index, measure(angles))?;
        }
        let mut fit = scan.fit()?;
        while !fit.advance(1000).is_complete() {}
        let bits: Vec<u32> = fit.finish()?.values().map(f32::to_bits).collect();
        constants += &format!("pub static {name}: &[u32] = &{bits:?};\n");
    }
    let memory =
        "FLASH : ORIGIN = 0x08000000, LENGTH = 512K RAM : ORIGIN = 0x20000000, LENGTH = 128K";
    fs::write(out.join("expected.rs"), constants)?;
    fs::write(out.join("memory.x"), format!("MEMORY {{ {memory} }}"))?;
    println!("cargo::rustc-check-cfg=cfg(rust_analyzer)"); // of embedded-test
    println!("cargo::rustc-link-search={}", out.display());
    for argument in ["-Tlink.x", "-Tembedded-test.x", "--nmagic"] {
        println!("cargo::rustc-link-arg-tests={argument}");
    }
    Ok(())
}
