//! A recipe of the model Linear at the command line.

use std::fs;

use glimpse_core::geometry::Angles;
use glimpse_core::gonio::Limits;
use glimpse_core::recipe::{
    Effort, Expectation, Field, Ingredients, Noise, Origin, Parts, Provenance, Recipe, RecipeError,
    Schedule, Training, TrainingSource, TrainingSources, ValidationSplit,
};
use glimpse_training::linear::ReducedBasis;
use glimpse_training::meta::learned::LearnedFit;
use glimpse_training::recipe::{RecipeFile, packed_fit, packed_pattern};
use serde_json::{Value, json};

use super::common::assert_names;
use super::{fail_naming, succeed, succeed_as_json};

fn pattern() -> [Angles<f32>; 3] {
    [0.1, 0.2, 0.3].map(|theta_h| Angles {
        theta_h,
        theta_d: 0.2,
        phi_d: 1.0,
    })
}

fn reduced() -> ReducedBasis {
    ReducedBasis {
        basis: vec![1.5, -2.0, 0.25, 8.0, 3.0, -0.1],
        mean: vec![-0.5, 0.0, 0.5],
        median: vec![0.25, 0.0, 1.5],
        weight: vec![0.9, 0.8, 0.7],
        precision: vec![40.0; 2],
        basis_checksum: 0x0123_abcd,
    }
}

const SOURCES: [TrainingSource<'_>; 1] = [TrainingSource {
    label: "procedural:7",
    origin: Origin::BuiltIn,
    materials: 7,
    share: 1.0,
}];

/// States all that a recipe can state.
fn with_statements(bare: Ingredients<'_>) -> Ingredients<'_> {
    Ingredients {
        limits: Some(Limits {
            max_theta_i: 1.25,
            max_theta_o: 1.5,
            min_separation: 0.125,
            in_plane: true,
        }),
        noise: Some(Noise {
            multiplicative: 0.02,
            additive: 0.001,
            levels: 4096,
        }),
        expectation: Some(Expectation {
            loss: 0.0125,
            standard_error: Some(0.0015),
            materials: 7,
            on: "materials of nowhere",
        }),
        provenance: Some(Provenance {
            trainer: "test",
            data: "procedural:7",
            materials: 7,
            schedule: "joint quick",
            seed: 5,
            options: "no options",
        }),
        materials: &[("brass", 1), ("felt", 2), ("silk", 3), ("teflon", u32::MAX)],
        training: Some(Training {
            schedule: Schedule::Joint,
            effort: Effort::Quick,
            parts: Parts::All,
            split: ValidationSplit::LeftOut,
            digest: 0x0123_4567_89ab_cdef,
            sources: TrainingSources::new(&SOURCES),
        }),
        ..bare
    }
}

fn write(
    reduced: ReducedBasis,
    state: fn(Ingredients<'_>) -> Ingredients<'_>,
) -> Result<RecipeFile, RecipeError> {
    packed_fit(&LearnedFit::Ridge(reduced), |fit| {
        RecipeFile::write(&state(Ingredients::new(&packed_pattern(&pattern()), fit)))
    })
}

/// A recipe of all that can be stated.
pub(crate) fn stated() -> RecipeFile {
    write(reduced(), with_statements).expect("it is a recipe")
}

/// A list that JSON holds, as the f32 that it was written from.
fn numbers(list: &Value) -> Vec<f32> {
    let list = list.as_array().expect("a list");
    list.iter()
        .map(|number| number.as_f64().expect("a number") as f32)
        .collect()
}

#[test]
fn a_linear_recipe_is_shown_and_exported() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    let mut unequal = reduced();
    unequal.precision[1] = 4.0;
    unequal.basis_checksum = 0;
    for (name, reduced) in [("equal.recipe", reduced()), ("unequal.recipe", unequal)] {
        let file = write(reduced.clone(), with_statements).expect("it is a recipe");
        fs::write(directory.join(name), file.bytes()).expect("it is written");
        let recipe = file.recipe();
        assert!(recipe.pattern().eq(pattern()));
        let ridge = recipe.ridge().expect("a ridge");
        assert!(ridge.basis().iter().eq(reduced.basis));
        assert!(ridge.precision().iter().eq(reduced.precision));
        for (format, extension) in [("json", "json"), ("rust", "rs"), ("postcard", "copy")] {
            let out = name.replace("recipe", extension);
            succeed(
                directory,
                &["export", name, "--format", format, "--out", &out],
            );
        }
        let copy = fs::read(directory.join(name.replace("recipe", "copy"))).expect("it is there");
        assert_eq!(copy, file.bytes());
    }
    let read = |name: &str| -> Value {
        let text = fs::read(directory.join(name)).expect("it is there");
        serde_json::from_slice(&text).expect("it is JSON")
    };

    let json = read("equal.json");
    let expected = reduced();
    assert_eq!(json["model"], "linear");
    assert_eq!(json["samples"], 3);
    assert_eq!(numbers(&json["pattern"][1]), [0.2, 0.2, 1.0]);
    assert_eq!(json["basis"].as_array().map(Vec::len), Some(3));
    assert_eq!(numbers(&json["basis"][1]), [0.25, 8.0]);
    assert_eq!(numbers(&json["mean"]), expected.mean);
    assert_eq!(numbers(&json["median"]), expected.median);
    assert_eq!(numbers(&json["weight"]), expected.weight);
    assert_eq!(json["eta"], 40.0);
    assert_eq!(json.get("precision"), None);
    assert_eq!(json.get("initial"), None);
    assert_eq!(json["basis_checksum"], "0123abcd");
    assert_eq!(
        json["expected_loss"].as_f64().map(|x| x as f32),
        Some(0.0125)
    );
    assert_eq!(json["provenance"]["data"], "procedural:7");
    assert_eq!(json["provenance"]["options"], "no options");
    assert_eq!(
        json["training"],
        json!({
            "schedule": "joint",
            "effort": "quick",
            "parts": "all",
            "split": "left-out",
            "digest": "0123456789abcdef",
            "sources": [
                {"label": "procedural:7", "origin": "built-in", "materials": 7, "share": 1.0},
            ],
        })
    );
    assert_eq!(
        json["limits"],
        json!({"max_theta_i": 1.25, "max_theta_o": 1.5, "min_separation": 0.125, "in_plane": true})
    );
    assert_eq!(json["noise"]["levels"], 4096);
    assert_eq!(json["expectation"]["on"], "materials of nowhere");
    assert_eq!(
        json["expectation"]["standard_error"]
            .as_f64()
            .map(|x| x as f32),
        Some(0.0015)
    );
    assert_eq!(
        json["materials"][3],
        json!({"name": "teflon", "digest": "ffffffff"})
    );
    let bytes = fs::read(directory.join("equal.recipe")).expect("it is there");
    let recipe = Recipe::parse(&bytes).expect("it is a recipe");
    assert_eq!(json["checksum"], format!("{:08x}", recipe.checksum()));

    let json = read("unequal.json");
    assert_eq!(json.get("eta"), None);
    assert_eq!(numbers(&json["precision"]), [40.0, 4.0]);
    assert_eq!(json["basis_checksum"], json!(null));

    let rust = fs::read_to_string(directory.join("equal.rs")).expect("it is there");
    for line in [
        "pub const PATTERN: [[f32; 3]; 3] = [",
        "pub const BASIS: [[f32; 2]; 3] = [\n    [1.5, -2.0],\n    [0.25, 8.0],\n    [3.0, -0.1],\n];",
        "pub const MEDIAN: [f32; 3] = [\n    0.25, 0.0, 1.5,\n];",
        "pub const PRECISION: [f32; 2] = [\n    40.0, 40.0,\n];",
        "pub const BASIS_CHECKSUM: u32 = 0x0123abcd;",
    ] {
        assert!(rust.contains(line), "no {line} in {rust}");
    }
    assert!(!rust.contains("INNER_STEPS"));

    let shown = succeed(directory, &["inspect", "equal.recipe"]);
    let figures = [
        "2", "40", "0123abcd", "0.0125", "0.0015", "7", "71.6", "85.9", "7.2", "0.02", "0.001",
        "4096", "4",
    ];
    assert_names(&shown, &figures);
    let names = ["linear", "procedural:7", "brass", "felt", "silk"];
    assert_names(&shown, &names);
    let shown = succeed(directory, &["inspect", "unequal.recipe"]);
    assert_names(&shown, &["4.00e0", "4.00e1"]);
}

#[test]
fn a_recipe_that_states_nothing_is_shown_and_exported() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    let file = write(reduced(), |bare| bare).expect("it is a recipe");
    fs::write(directory.join("bare.recipe"), file.bytes()).expect("it is written");
    succeed(directory, &["inspect", "bare.recipe"]);
    for format in ["json", "rust"] {
        let arguments = ["export", "bare.recipe", "--format", format, "--out", format];
        succeed(directory, &arguments);
    }
    let json = succeed_as_json(directory, &["inspect", "bare.recipe", "--json"]);
    for field in [
        "expected_loss",
        "limits",
        "noise",
        "expectation",
        "provenance",
        "training",
        "materials",
    ] {
        assert_eq!(json[field], Value::Null, "{field}");
    }
}

#[test]
fn a_linear_recipe_is_not_judged_without_its_basis() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let file = write(reduced(), with_statements).expect("it is a recipe");
    fs::write(scratch.path().join("linear.recipe"), file.bytes()).expect("it is written");
    for method in ["ours", "meta"] {
        let arguments = [
            "evaluate",
            "--recipe",
            "linear.recipe",
            "--method",
            method,
            "--test",
            "procedural:2",
        ];
        fail_naming(scratch.path(), &arguments, &["linear.basis"]);
    }
}

#[test]
fn a_basis_that_does_not_fit_its_pattern_is_refused() {
    let mut wrong = reduced();
    wrong.basis.pop();
    let error = write(wrong, with_statements).expect_err("it is short");
    assert_eq!(error, RecipeError::Count(Field::Basis));
    let mut wrong = reduced();
    wrong.weight[2] = 0.0;
    let error = write(wrong, with_statements).expect_err("its weight is 0");
    assert_eq!(error, RecipeError::NotPositive(Field::Weight));
}
