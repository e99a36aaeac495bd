//! Tests of the C examples on a host: no warnings, no undefined behavior found by sanitizers, the same bits as core.

#![allow(clippy::arithmetic_side_effects, clippy::unwrap_used)]

mod common;

use std::path::PathBuf;
use std::process::Command;
use std::{env, fs};

use common::{compile, expected, folder, run};
use glimpse_core::recipe::Recipe;

/// Builds the library, because cargo does not build static libraries for tests. Its dependencies are already compiled.
fn library() -> String {
    let mut target: PathBuf = env::current_exe().unwrap();
    for _ in 0..3 {
        target.pop(); // from target/debug/deps/c-...
    }
    let (profile, profile_folder) = match cfg!(debug_assertions) {
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
    let library = target.join(profile_folder).join("libglimpse.a");
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
fn examples_match_core() {
    let library = library();
    let directory = tempfile::tempdir().unwrap();
    let option_sets: [&[&str]; 3] = [
        &["-O0"],
        &["-O2"],
        &["-O1", "-g", SANITIZERS, "-fno-sanitize-recover=all"],
    ];
    for options in option_sets {
        if options.contains(&SANITIZERS) && !has_sanitizers() {
            println!("cc has no sanitizers");
            continue;
        }
        let options = [options, &[&library]].concat();
        let [scan, driver] = expected();
        for (example, expected) in [
            ("scan.c", scan),
            ("driver.c", driver),
            ("../tests/misuse.c", String::new()),
        ] {
            let out = directory.path().join("example");
            compile("cc", "host.c", example, &options, &out);
            let printed = run(&mut Command::new(&out));
            assert_eq!(printed, expected, "{example} {options:?}");
        }
    }
}

/// The test of misuse calls every function that returns a status.
#[test]
fn misuse_calls_every_function() {
    let [header, misuse] = ["include/glimpse.h", "tests/misuse.c"]
        .map(|file| fs::read_to_string(folder().join(file)).unwrap());
    for line in header.lines() {
        if let Some(declaration) = line.strip_prefix("glimpse_status glimpse_") {
            let (name, _) = declaration.split_once('(').unwrap();
            assert!(misuse.contains(&format!("glimpse_{name}(")), "{name}");
        }
    }
}

/// Recipes in the README's table.
const RECIPES: [&str; 7] = [
    "paper/neural-n8",
    "paper/phong-n8",
    "paper/cook-torrance-n8",
    "paper/linear-n8",
    "completed/neural-n8",
    "completed/neural-n32",
    "completed/linear-n32",
];

fn recipe(name: &str) -> Vec<u8> {
    let path = folder().join("../../trainer/recipes");
    fs::read(path.join(format!("{name}.recipe"))).unwrap()
}

fn words(name: &str) -> usize {
    let bytes = recipe(name);
    Recipe::parse(&bytes).unwrap().memory_words()
}

/// Returns `GLIMPSE_SCAN_BYTES(words)` and `GLIMPSE_DRIVER_BYTES(words)` for pointers of `pointer_bytes` bytes.
fn sizes(words: usize, pointer_bytes: usize) -> [usize; 2] {
    let scan = 69 * pointer_bytes + 160 + 4 * words;
    [scan, scan + 648]
}

/// The table is for 32-bit machines.
#[test]
fn readme_memory_table_is_correct() {
    let readme = fs::read_to_string(folder().join("README.md")).unwrap();
    for name in RECIPES {
        let [scan, driver] = sizes(words(name), 4).map(thousands);
        let words = thousands(words(name));
        let row = format!("| `{name}` | {words} | {scan} | {driver} |");
        assert!(readme.contains(&row), "{row}");
    }
}

/// The memory of the examples is enough for their largest recipe.
#[test]
fn example_memory_fits_largest_recipe() {
    let largest = RECIPES.into_iter().filter(|name| name.ends_with("-n8"));
    let largest = largest.map(words).max().unwrap();
    let header = fs::read_to_string(folder().join("examples/example.h")).unwrap();
    let line = format!("#define RECIPE_WORDS {largest}\n");
    assert!(header.contains(&line), "{line}");
}

fn thousands(number: usize) -> String {
    match number / 1000 {
        0 => number.to_string(),
        thousands => format!("{thousands},{:03}", number % 1000),
    }
}

/// The header is valid C++, and its macros have the values of [`sizes`]. Tests in src/ compare them with the library.
#[test]
fn header_compiles_as_cpp() {
    let directory = tempfile::tempdir().unwrap();
    let source = directory.path().join("header.cpp");
    let [scan, driver] = sizes(87, size_of::<usize>());
    let text = format!(
        "#include \"glimpse.h\"\nstatic GLIMPSE_MEMORY(memory, GLIMPSE_SCAN_BYTES(87));\n\
        unsigned char *first() {{ return memory; }}\n\
        static_assert(sizeof(memory) == {scan} && GLIMPSE_DRIVER_BYTES(87) == {driver}, \"\");\n\
        static_assert(GLIMPSE_STORE_BYTES(16) == 768, \"\");\n"
    );
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
