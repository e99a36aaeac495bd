//! `trainer render view`

use std::fs;
use std::path::Path;

use glimpse_core::recipe::Recipe;
use glimpse_materials::{Material, Procedural};
use serde_json::Value;

use super::{fail_naming, succeed};

const RECIPES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/recipes");

fn recipe(name: &str) -> String {
    format!("{RECIPES}/{name}.recipe")
}

/// What the scripts of a page are given.
fn data(page: &Path) -> Value {
    let html = fs::read_to_string(page).expect("it is there");
    let (_, data) = html
        .split_once("<script type=\"application/json\" id=\"data\">")
        .expect("it has data");
    let (data, _) = data.split_once("</script>").expect("they end");
    serde_json::from_str(data).expect("they are JSON")
}

#[test]
fn a_page_has_every_recipe_and_what_was_read() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    let recipes = [
        "phong-n8",
        "completed/cook-torrance-n8",
        "neural-n8",
        "masked/neural-n16",
    ]
    .map(recipe);
    let [a, b, c, d] = recipes.each_ref().map(String::as_str);
    let view = [
        "render",
        "view",
        a,
        b,
        c,
        d,
        "--material",
        "procedural:1:77",
    ];
    assert_eq!(succeed(directory, &view), "");
    let html = fs::read_to_string(directory.join("view.html")).expect("it is there");
    // All of it is in the page.
    for outside in ["http://", "https://", "src=", "@import", "fetch("] {
        assert!(!html.contains(outside), "{outside}");
    }
    assert!(
        html.contains("<script>\"use strict\";"),
        "scripts are not to be escaped"
    );
    let data = data(&directory.join("view.html"));
    assert_eq!(data["title"], "procedural-77-000-metal");
    assert!(data["reference"]["table_loss"].as_f64().expect("a number") < 2e-3);
    let shown = data["shown"].as_array().expect("a list");
    let of = |name: &str| -> Vec<&Value> { shown.iter().map(|shown| &shown[name]).collect() };
    assert_eq!(of("model"), ["phong", "cook-torrance", "neural", "neural"]);
    assert_eq!(
        of("name"),
        ["phong-n8", "cook-torrance-n8", "neural-n8", "neural-n16"]
    );
    assert_eq!(of("takes_missing"), [false, false, false, true]);
    let material = &Procedural::set(1, 77)[0];
    for (path, shown) in recipes.iter().zip(shown) {
        let bytes = fs::read(path).expect("it is there");
        let recipe = Recipe::parse(&bytes).expect("it is a recipe");
        let samples = shown["samples"].as_array().expect("a list");
        assert_eq!(samples.len(), recipe.samples());
        for (sample, angles) in samples.iter().zip(recipe.pattern()) {
            // Text that gives the same 32-bit floats back.
            let read: [f32; 3] =
                serde_json::from_value(sample["brdf"].clone()).expect("three numbers");
            assert_eq!(read, material.brdf(angles));
        }
    }

    // The same seed, the same noise; another one, another.
    let noisy = |seed: &str| {
        let noise = ["--noise", "0.05", "--seed", seed, "--out", "noisy.html"];
        succeed(directory, &[&view[..], &noise[..]].concat());
        fs::read(directory.join("noisy.html")).expect("it is there")
    };
    assert!(noisy("1") == noisy("1") && noisy("1") != noisy("2"));
}

#[test]
fn readings_from_a_lab_are_shown_without_a_reference() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    let rows = "index,r,g,b\n0,0.2,0.1,0.05\n3,0.3,0.2,0.1\n7,,,\n9,0.25,0.12,0.06\n";
    fs::write(directory.join("<gold>.csv"), rows).expect("it can be written");
    let masked = recipe("masked/neural-n16");
    let view = ["render", "view", &masked, "--measurements", "<gold>.csv"];
    succeed(directory, &view);
    let data = data(&directory.join("view.html"));
    assert_eq!(
        (&data["title"], &data["reference"]),
        (&Value::from("<gold>"), &Value::Null)
    );
    let samples = data["shown"][0]["samples"].as_array().expect("a list");
    let read = samples.iter().filter(|sample| !sample["brdf"].is_null());
    assert_eq!(read.count(), 3);
    let html = fs::read_to_string(directory.join("view.html")).expect("it is there");
    assert!(!html.contains("<gold>"), "a name has become markup");

    succeed(
        directory,
        &[
            &view[..],
            &["--reference", "procedural:1:2", "--out", "both.html"],
        ]
        .concat(),
    );
    fail_naming(
        directory,
        &[
            "render",
            "view",
            &recipe("neural-n8"),
            "--measurements",
            "<gold>.csv",
        ],
        &["<gold>.csv", "8"],
    );
}

#[test]
fn what_cannot_be_shown_is_refused_with_a_remedy() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    let (neural, linear) = (recipe("neural-n8"), recipe("completed/linear-n8"));
    let (neural, linear) = (neural.as_str(), linear.as_str());
    fs::write(directory.join("a.csv"), "index,r,g,b\n0,1,1,1\n").expect("it can be written");
    let material = ["--material", "procedural:1:77"];
    for (more, named) in [
        (vec![neural], &["--material", "--measurements"][..]),
        (
            vec![neural, neural, "--material", "procedural:1"],
            &["neural-n8"],
        ),
        (
            vec![linear, material[0], material[1]],
            &["linear-n8.basis", "--basis", "--format"],
        ),
        (vec![neural, "--material", "procedural:2"], &["2"]),
        (
            vec![neural, "--measurements", "a.csv", "a.csv"],
            &["2", "--measurements", "1"],
        ),
        (
            vec![neural, "--measurements", "a.csv", "--noise", "0.1"],
            &["--noise"],
        ),
        (
            vec![neural, "--material", "procedural:1", "--noise", "1.5"],
            &["0", "1"],
        ),
        (
            vec![
                neural,
                "--material",
                "procedural:1",
                "--reference",
                "procedural:1",
            ],
            &["--material", "--reference"],
        ),
        (
            vec![neural, "--material", "procedural:1", "--out", "a.png"],
            &[".html"],
        ),
        (
            vec!["nothing.recipe", material[0], material[1]],
            &["nothing.recipe"],
        ),
        (
            vec![neural, material[0], material[1], "--basis", "a.csv"],
            &["a.csv"],
        ),
    ] {
        fail_naming(directory, &[&["render", "view"], &more[..]].concat(), named);
    }
    assert!(!directory.join("view.html").exists());
}
