//! The examples in C on a host: no warnings, no undefined behaviour that sanitizers find, Rust's bits.

mod common;

use std::path::PathBuf;
use std::process::Command;
use std::{env, fs};

use common::{compile, expected, folder, run};

/// Cargo puts it two folders above a test's executable.
fn library() -> String {
    let mut path: PathBuf = env::current_exe().unwrap();
    path.pop();
    let deps = path.clone();
    path.pop();
    // `cargo test` builds it in `deps`; only `cargo build` puts it where its name says.
    let newest = |folder: &PathBuf| {
        let files = fs::read_dir(folder).unwrap().flatten();
        let libraries = files.filter(|file| {
            let name = file.file_name().into_string().unwrap_or_default();
            name.starts_with("libglimpse") && name.ends_with(".a") && !name.contains("core")
        });
        libraries
            .max_by_key(|file| file.metadata().and_then(|data| data.modified()).ok())
            .map(|file| file.path())
    };
    let found = newest(&deps).or_else(|| newest(&path));
    found.expect("the library").display().to_string()
}

/// Does nothing if the compiler has no sanitizers.
const SANITIZERS: &str = "-fsanitize=address,undefined";

fn has_sanitizers() -> bool {
    let directory = tempfile::tempdir().unwrap();
    let source = directory.path().join("empty.c");
    fs::write(&source, "int main(void) { return 0; }\n").unwrap();
    let out = directory.path().join("empty");
    let compiled = Command::new("cc").arg(SANITIZERS).arg(&source).arg("-o").arg(&out);
    let compiled = compiled.output().unwrap();
    compiled.status.success() && Command::new(&out).status().is_ok_and(|status| status.success())
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
            assert_eq!(run(&mut Command::new(&out)), expected, "{example} {options:?}");
        }
    }
}

/// The header's macros and the library's own numbers, for the library as it was built and for others.
#[test]
fn the_headers_constants_are_the_librarys() {
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
            .arg(library())
            .arg("-o")
            .arg(&out);
        run(&mut command);
        let linear = 4 * glimpse_core::fit::linear_words(samples, components);
        let scan = 38 * samples + 5520 + linear + 48 * size_of::<usize>() + 64;
        let printed = run(&mut Command::new(&out));
        assert_eq!(printed, format!("{scan} {}\n", scan + 1024));
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
