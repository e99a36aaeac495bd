//! Tests of the C examples on microcontrollers: compiled by Arm's compiler, run in QEMU, with the same bits as Rust.
//!
//! `tests/run targets` builds the libraries for linking.

#![allow(clippy::arithmetic_side_effects, clippy::unwrap_used)]

mod common;

use std::process::Command;

use common::{compile, expected, folder, run};

/// A microcontroller in QEMU: target, machine, and options of the C compiler.
struct Board {
    triple: &'static str,
    machine: &'static str,
    options: &'static [&'static str],
}

const BOARDS: [Board; 2] = [
    Board {
        triple: "thumbv7em-none-eabihf",
        machine: "netduinoplus2",
        options: &["-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"],
    },
    // This machine has 16 KiB of RAM.
    Board {
        triple: "thumbv6m-none-eabi",
        machine: "microbit",
        options: &[
            "-mcpu=cortex-m0",
            "-mfloat-abi=soft",
            "-Wl,--defsym=SMALL=1",
        ],
    },
];

#[test]
fn examples_match_core_in_qemu() {
    let directory = tempfile::tempdir().unwrap();
    let script = folder().join("examples/board.ld");
    let script = format!("-T{}", script.display());
    for board in BOARDS {
        let library = folder()
            .join("../../embedded-demo/target")
            .join(board.triple)
            .join("release/libglimpse.a");
        assert!(
            library.exists(),
            "{} does not exist: build it with `tests/run targets`",
            library.display()
        );
        let library = library.display().to_string();
        let common = [
            "-mthumb",
            "-Os",
            "-nostartfiles",
            &script,
            "-Wl,--gc-sections",
            "-Wl,--no-warn-rwx-segments,-z,noexecstack",
            &library,
        ];
        let options = [board.options, &common].concat();
        for (example, expected) in ["scan.c", "driver.c"].into_iter().zip(expected()) {
            let out = directory.path().join("example.elf");
            compile("arm-none-eabi-gcc", "board.c", example, &options, &out);
            let mut emulator = Command::new("timeout");
            emulator
                .args(["120", "qemu-system-arm", "-machine", board.machine])
                .args(["-display", "none", "-monitor", "none", "-serial", "none"])
                .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
                .arg(&out);
            assert_eq!(
                run(&mut emulator),
                expected,
                "{example} on {}",
                board.triple
            );
        }
    }
}
