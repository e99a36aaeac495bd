//! Passes the linker scripts to the linker.

use std::env;

/// The folder of the chip's memory layout.
const MEMORY: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/memory/stm32f405");

fn main() {
    println!("cargo::rerun-if-changed={MEMORY}");
    println!("cargo::rustc-link-search={MEMORY}");
    let mut arguments = vec!["-Tlink.x", "-Tdefmt.x"];
    arguments.push("--nmagic"); // sections in flash need no padding to 64 KiB pages
    if env::var_os("CARGO_FEATURE_PROVE_NO_PANIC").is_some() {
        // defmt's default handler is always linked, and panics. Nothing calls it.
        arguments.push("--defsym=__defmt_default_panic=Reset");
    }
    for argument in arguments {
        println!("cargo::rustc-link-arg-bins={argument}");
    }
}
