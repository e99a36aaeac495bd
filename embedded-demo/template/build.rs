//! Passes the recipe and linker scripts.

use std::path::PathBuf;

/// The recipe's file.
const RECIPE: &str = "{{glimpse}}/trainer/recipes/completed/neural-n8.recipe";

fn main() {
    let folder = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    let recipe = folder.join(RECIPE);
    assert!(recipe.exists(), "{} does not exist", recipe.display());
    println!("cargo:rustc-env=RECIPE={}", recipe.display());
    println!("cargo:rerun-if-changed={}", recipe.display());
    {%- if board == "esp32c6" %}
    let arguments = ["-Tlinkall.x", "-Tdefmt.x"];
    {%- else %}
    let arguments = ["-Tlink.x", "-Tdefmt.x", "--nmagic"];
    println!("cargo:rustc-link-search={}/memory/{{board}}", folder.display());
    println!("cargo:rerun-if-changed=memory");
    {%- endif %}
    for argument in arguments {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
}
