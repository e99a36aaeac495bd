//! Passes the memory layout of QEMU's machine and the linker scripts to the linker.

use std::path::PathBuf;
use std::{env, fs, io};

fn main() -> io::Result<()> {
    println!("cargo::rerun-if-changed=../memory");
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(chip, values(any()))");
    let target = env::var("TARGET").unwrap_or_default();
    let chip = match target.as_str() {
        "thumbv7em-none-eabihf" | "thumbv7em-none-eabi" => "stm32f405",
        "thumbv8m.main-none-eabihf" => "mps2-an505",
        "thumbv6m-none-eabi" => "nrf51822",
        "riscv32imc-unknown-none-elf" => "virt",
        _ => return Ok(()), // only the library is built for a host
    };
    println!("cargo::rustc-cfg=chip=\"{chip}\"");
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or(io::ErrorKind::NotFound)?);
    fs::copy(format!("../memory/{chip}.x"), out.join("memory.x"))?;
    println!("cargo::rustc-link-search={}", out.display());
    if chip == "virt" {
        println!("cargo::rustc-link-arg-bins=-Tmemory.x"); // riscv-rt's link.x does not include it
    }
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
    println!("cargo::rustc-link-arg-bins=--nmagic");
    Ok(())
}
