//! The compact basis at the command line: one file for recipes of every n.

use std::fs;
use std::path::Path;

use glimpse_core::model::linear::Basis;
use glimpse_core::recipe::Recipe;
use serde_json::Value;

use super::shared::{LINEAR_N2, LINEAR_N4};
use super::{fail_naming, succeed};

const TEST: &str = "procedural:1:9";
const PHONG: &[u8] = include_bytes!("../../../core/examples/recipes/phong-n8.recipe");

fn train(directory: &Path, [model, schedule]: [&str; 2], samples: &str, seed: &str, out: &str) {
    let arguments = [
        "train",
        "--model",
        model,
        "--schedule",
        schedule,
        "--samples",
        samples,
        "--data",
        "procedural:6",
        "--effort",
        "brief",
        "--seed",
        seed,
        "--out",
        out,
    ];
    succeed(directory, &arguments);
}

fn export(recipe: &str, out: &str) -> Vec<String> {
    ["export", recipe, "--format", "basis", "--out", out]
        .map(str::to_owned)
        .to_vec()
}

fn loss(directory: &Path, arguments: &[&str]) -> f64 {
    let text = succeed(
        directory,
        &[&["evaluate", "--json", "--test", TEST], arguments].concat(),
    );
    let json: Value = serde_json::from_str(&text).expect("it is JSON");
    json["loss"].as_f64().expect("a number")
}

#[test]
fn one_compact_basis_serves_every_n() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    let read = |name: &str| fs::read(directory.join(name)).expect("it is there");
    let run = |arguments: &[String]| {
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        succeed(directory, &arguments)
    };
    LINEAR_N2.copy_to(directory);
    LINEAR_N4.copy_to(directory);
    run(&export("linear-n2.recipe", "compact.basis"));
    run(&export("linear-n4.recipe", "again.basis"));
    assert_eq!(read("compact.basis"), read("again.basis"));

    let compact = read("compact.basis");
    let basis = Basis::parse(&compact).expect("it is a basis");
    for name in ["linear-n2.recipe", "linear-n4.recipe"] {
        let bytes = read(name);
        let recipe = Recipe::parse(&bytes).expect("it is a recipe");
        let ridge = recipe.ridge().expect("it is Linear");
        assert_eq!(ridge.basis_checksum(), Some(basis.of()));
        assert!(basis.components() <= ridge.components());
        let whole = loss(directory, &["--recipe", name]);
        let compact = loss(directory, &["--recipe", name, "--basis", "compact.basis"]);
        println!("{name}: {whole:.5} by the whole basis, {compact:.5} by the compact one");
        assert!(
            compact != whole && (compact - whole).abs() < 0.1 * whole,
            "{compact}, {whole}"
        );
    }

    // By schedule prior coefficients are of another scale: the basis is another one, for every n too.
    train(directory, ["linear", "prior"], "2", "0", "p2.recipe");
    train(directory, ["linear", "prior"], "3", "0", "p3.recipe");
    run(&export("p2.recipe", "prior.basis"));
    let over = export("p3.recipe", "again.basis");
    let over: Vec<&str> = over.iter().map(String::as_str).collect();
    fail_naming(directory, &over, &["again.basis", "--force"]);
    assert_eq!(read("again.basis"), compact);
    run(&export("p3.recipe", "prior-again.basis"));
    assert_eq!(read("prior.basis"), read("prior-again.basis"));
    let whole = loss(directory, &["--recipe", "p3.recipe"]);
    let by_compact = loss(
        directory,
        &["--recipe", "p3.recipe", "--basis", "prior.basis"],
    );
    println!("p3.recipe: {whole:.5} by the whole basis, {by_compact:.5} by the compact one");
    assert!(
        by_compact != whole && (by_compact - whole).abs() < 0.1 * whole,
        "{by_compact}, {whole}"
    );

    // Fewer components, when asked for.
    let mut fewer = export("linear-n2.recipe", "fewer.basis");
    fewer.extend(["--components", "3"].map(str::to_owned));
    run(&fewer);
    let bytes = read("fewer.basis");
    assert_eq!(Basis::parse(&bytes).map(|basis| basis.components()), Ok(3));

    // Another seed shuffles the materials, and has a basis of its own.
    train(directory, ["linear", "joint"], "2", "1", "other.recipe");
    let arguments = [
        "evaluate",
        "--recipe",
        "other.recipe",
        "--basis",
        "compact.basis",
        "--test",
        TEST,
    ];
    fail_naming(directory, &arguments, &[]);

    // What is asked for without effect or sense.
    for components in ["0", "999"] {
        let arguments = [
            "export",
            "linear-n2.recipe",
            "--format",
            "basis",
            "--components",
            components,
            "--out",
            "x",
        ];
        fail_naming(directory, &arguments, &["--components"]);
    }
    let arguments = [
        "export",
        "linear-n2.recipe",
        "--format",
        "json",
        "--components",
        "3",
        "--out",
        "x",
    ];
    fail_naming(
        directory,
        &arguments,
        &["--components", "--format", "basis"],
    );
    let mut damaged = compact.clone();
    damaged[100] ^= 1;
    fs::write(directory.join("damaged.basis"), damaged).expect("it is written");
    let arguments = [
        "evaluate",
        "--recipe",
        "linear-n2.recipe",
        "--basis",
        "damaged.basis",
        "--test",
        TEST,
    ];
    fail_naming(directory, &arguments, &["damaged.basis"]);
    assert!(!directory.join("x").exists());
}

#[test]
fn a_compact_basis_is_for_linear() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    fs::write(directory.join("phong.recipe"), PHONG).expect("it is written");
    fail_naming(
        directory,
        &["export", "phong.recipe", "--format", "basis", "--out", "x"],
        &["linear"],
    );
    assert!(!directory.join("x").exists());
    let arguments = [
        "evaluate",
        "--method",
        "random",
        "--model",
        "linear",
        "--samples",
        "2",
        "--basis",
        "x",
        "--test",
        TEST,
    ];
    fail_naming(directory, &arguments, &["--recipe"]);
}
