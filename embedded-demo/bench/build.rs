//! Passes the memory layout of QEMU's machine and the linker scripts to the linker.

use std::env;

fn main() {
    let memory = concat!(env!("CARGO_MANIFEST_DIR"), "/../memory");
    println!("cargo::rerun-if-changed={memory}");
    println!("cargo::rustc-check-cfg=cfg(chip, values(any()))");
    let chip = match env::var("TARGET").unwrap_or_default().as_str() {
        "thumbv7em-none-eabihf" | "thumbv7em-none-eabi" => "stm32f405",
        "thumbv8m.main-none-eabihf" => "mps2-an505",
        "thumbv6m-none-eabi" => "nrf51822",
        "riscv32imc-unknown-none-elf" => "virt",
        _ => return, // only the library is built for a host
    };
    println!("cargo::rustc-cfg=chip=\"{chip}\"");
    println!("cargo::rustc-link-search={memory}/{chip}");
    // riscv-rt's link.x does not include memory.x
    let layout = (chip == "virt").then_some("-Tmemory.x");
    for argument in layout.into_iter().chain(["-Tlink.x", "--nmagic"]) {
        println!("cargo::rustc-link-arg-bins={argument}");
    }
}
