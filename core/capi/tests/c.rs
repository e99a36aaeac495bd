//! The examples in C on a host: no warnings, no undefined behaviour that sanitizers find, Rust's bits.

mod common;

use std::path::PathBuf;
use std::process::Command;
use std::{env, fs};

use common::{compile, expected, folder, run};
use glimpse_core::fit::linear_words;

/// Builds the library: cargo itself builds no static library for tests. What it depends on is there.
fn library() -> String {
    let mut target: PathBuf = env::current_exe().unwrap();
    for _ in 0..3 {
        target.pop(); // from target/debug/deps/c-...
    }
    let (profile, folder_of_profile) = match cfg!(debug_assertions) {
        true => ("dev", "debug"),
        false => ("release", "release"),
    };
    let mut cargo = Command::new(env!("CARGO"));
    cargo
        .args(["build", "--quiet", "--lib", "--profile", profile])
        .arg("--manifest-path")
        .arg(folder().join("Cargo.toml"))
        .arg("--target-dir")
        .arg(&target);
    run(&mut cargo);
    let library = target.join(folder_of_profile).join("libglimpse.a");
    assert!(library.exists(), "{}", library.display());
    library.display().to_string()
}

const SANITIZERS: &str = "-fsanitize=address,undefined";

fn has_sanitizers() -> bool {
    let directory = tempfile::tempdir().unwrap();
    let source = directory.path().join("empty.c");
    fs::write(&source, "int main(void) { return 0; }\n").unwrap();
    let out = directory.path().join("empty");
    let mut compile = Command::new("cc");
    compile.arg(SANITIZERS).arg(&source).arg("-o").arg(&out);
    let is_compiled = compile.output().unwrap().status.success();
    is_compiled
        && Command::new(&out)
            .status()
            .is_ok_and(|status| status.success())
}

#[test]
fn the_examples_print_the_bits_of_rust() {
    let library = library();
    let directory = tempfile::tempdir().unwrap();
    let all: [&[&str]; 3] = [
        &["-O0"],
        &["-O2"],
        &["-O1", "-g", SANITIZERS, "-fno-sanitize-recover=all"],
    ];
    for options in all {
        if options.contains(&SANITIZERS) && !has_sanitizers() {
            println!("cc has no sanitizers");
            continue;
        }
        let options = [options, &[&library]].concat();
        for (example, expected) in ["scan.c", "driver.c"].into_iter().zip(expected()) {
            let out = directory.path().join("example");
            compile("cc", "host.c", example, &options, &out);
            let printed = run(&mut Command::new(&out));
            assert_eq!(printed, expected, "{example} {options:?}");
        }
    }
}

/// The header's macros and the library's own numbers, for the library as it was built and for others.
#[test]
fn the_headers_constants_are_the_librarys() {
    let library = library();
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("sizes");
    let source = directory.path().join("sizes.c");
    let text = "#include <stdio.h>\n#include \"glimpse.h\"\n\
        _Static_assert(sizeof(glimpse_status) == 4, \"as in Rust\");\n\
        GLIMPSE_MEMORY(memory, GLIMPSE_DRIVER_BYTES);\n\
        int main(void) {\n\
        printf(\"%zu %zu\\n\", (size_t)GLIMPSE_SCAN_BYTES, sizeof memory);\n\
        return glimpse_scan_bytes() > GLIMPSE_SCAN_BYTES \
        || glimpse_driver_bytes() > sizeof memory || (size_t)memory % GLIMPSE_ALIGNMENT; }\n";
    fs::write(&source, text).unwrap();
    for (samples, components) in [(32, 60), (64, 60), (512, 60), (40, 100)] {
        let mut command = Command::new("cc");
        command
            .args(["-std=c11", "-Wall", "-Wextra", "-Werror", "-I"])
            .arg(folder().join("include"))
            .arg(format!("-DGLIMPSE_SAMPLES={samples}"))
            .arg(format!("-DGLIMPSE_COMPONENTS={components}"))
            .arg(&source)
            .arg(&library)
            .arg("-o")
            .arg(&out);
        run(&mut command);
        let scan = scan_bytes(samples, components, 8848, size_of::<usize>());
        let printed = run(&mut Command::new(&out));
        assert_eq!(printed, format!("{scan} {}\n", scan + 1024));
    }
}

/// The header's formula, on a machine with pointers of `pointer` bytes.
fn scan_bytes(samples: usize, components: usize, model: usize, pointer: usize) -> usize {
    let linear = 4 * linear_words(samples, components);
    let linear = if components == 0 { 0 } else { linear };
    38 * samples + model + linear + 48 * pointer + 64
}

/// On 32-bit machines.
#[test]
fn the_readmes_table_of_memory_is_right() {
    let readme = fs::read_to_string(folder().join("README.md")).unwrap();
    for (models, samples, components, model) in [
        ("any", 32, 60, 8848),
        ("any", 8, 5, 8848),
        ("Neural", 8, 0, 5400),
        ("Phong", 8, 0, 1720),
        ("Cook-Torrance", 8, 0, 1728),
        ("Linear", 8, 5, 0),
    ] {
        let scan = scan_bytes(samples, components, model, 4);
        let components = match components {
            0 => String::new(),
            m => format!("{m} "),
        };
        let [scan, driver] = [scan, scan + 1024].map(thousands);
        let row = format!("| {models} | {samples} | {components}| {scan} | {driver} |");
        assert!(readme.contains(&row), "{row}");
    }
}

fn thousands(number: usize) -> String {
    match number / 1000 {
        0 => number.to_string(),
        many => format!("{many},{:03}", number % 1000),
    }
}

/// The header is C++ too.
#[test]
fn the_header_compiles_as_cpp() {
    let directory = tempfile::tempdir().unwrap();
    let source = directory.path().join("header.cpp");
    let text = "#include \"glimpse.h\"\nstatic GLIMPSE_MEMORY(memory, GLIMPSE_SCAN_BYTES);\n\
        unsigned char *first() { return memory; }\n";
    fs::write(&source, text).unwrap();
    let mut command = Command::new("c++");
    command
        .args(["-std=c++11", "-Wall", "-Wextra", "-Werror", "-c", "-I"])
        .arg(folder().join("include"))
        .arg(&source)
        .arg("-o")
        .arg(directory.path().join("header.o"));
    run(&mut command);
}
