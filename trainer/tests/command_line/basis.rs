//! The compact basis at the command line: one file for recipes of every n.

use std::fs;
use std::path::Path;

use glimpse_core::model::linear::Basis;
use glimpse_core::recipe::Recipe;
use serde_json::Value;

use super::{fail, succeed};

const TEST: &str = "procedural:3:9";

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
        "quick",
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
    train(directory, ["linear", "joint"], "2", "0", "n2.recipe");
    train(directory, ["linear", "joint"], "4", "0", "n4.recipe");
    run(&export("n2.recipe", "compact.basis"));
    run(&export("n4.recipe", "again.basis"));
    assert_eq!(read("compact.basis"), read("again.basis"));

    let compact = read("compact.basis");
    let basis = Basis::parse(&compact).expect("it is a basis");
    for name in ["n2.recipe", "n4.recipe"] {
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
    let message = fail(
        directory,
        &export("p3.recipe", "again.basis")
            .iter()
            .map(String::as_str)
            .collect::<Vec<_>>(),
    );
    assert!(
        message.contains("the basis of a recipe that would be lost"),
        "{message}"
    );
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
    let mut fewer = export("n2.recipe", "fewer.basis");
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
    let message = fail(directory, &arguments);
    assert!(message.contains("not of this recipe"), "{message}");

    // What is asked for without effect or sense.
    for components in ["0", "999"] {
        let arguments = [
            "export",
            "n2.recipe",
            "--format",
            "basis",
            "--components",
            components,
            "--out",
            "x",
        ];
        let message = fail(directory, &arguments);
        assert!(message.contains("--components"), "{message}");
    }
    let arguments = [
        "export",
        "n2.recipe",
        "--format",
        "json",
        "--components",
        "3",
        "--out",
        "x",
    ];
    let message = fail(directory, &arguments);
    assert!(
        message.contains("--components is for --format basis"),
        "{message}"
    );
    let mut damaged = compact.clone();
    damaged[100] ^= 1;
    fs::write(directory.join("damaged.basis"), damaged).expect("it is written");
    let arguments = [
        "evaluate",
        "--recipe",
        "n2.recipe",
        "--basis",
        "damaged.basis",
        "--test",
        TEST,
    ];
    let message = fail(directory, &arguments);
    assert!(
        message.contains("altered") && message.contains("damaged.basis"),
        "{message}"
    );
    assert!(!directory.join("x").exists());
}

#[test]
fn a_compact_basis_is_for_linear() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    train(directory, ["phong", "joint"], "1", "0", "phong.recipe");
    let message = fail(
        directory,
        &["export", "phong.recipe", "--format", "basis", "--out", "x"],
    );
    assert!(message.contains("model linear"), "{message}");
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
    let message = fail(directory, &arguments);
    assert!(message.contains("--recipe"), "{message}");
}
