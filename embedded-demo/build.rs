//! Puts the chip's memory where the linker looks for `memory.x`, and names the linker scripts.

use std::path::PathBuf;
use std::{env, fs, io};

/// For another chip name its file here.
const MEMORY: &str = "memory/stm32f405.x";

fn main() -> io::Result<()> {
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or(io::ErrorKind::NotFound)?);
    fs::copy(MEMORY, out.join("memory.x"))?;
    println!("cargo::rustc-link-search={}", out.display());
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
    println!("cargo::rustc-link-arg-bins=-Tdefmt.x");
    // Addresses of sections in flash need no padding to 64 KiB pages.
    println!("cargo::rustc-link-arg-bins=--nmagic");
    println!("cargo::rerun-if-changed={MEMORY}");
    println!("cargo::rerun-if-changed=build.rs");
    Ok(())
}
