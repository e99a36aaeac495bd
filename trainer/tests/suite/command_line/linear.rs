//! A recipe of the model Linear at the command line.

use glimpse_core::geometry::Angles;
use glimpse_core::gonio::Limits;
use glimpse_core::recipe::{
    Effort, ExpectedLoss, Field, Noise, Origin, Parts, Provenance, Recipe, RecipeError,
    RecipeParts, Schedule, Training, TrainingSource, TrainingSources, ValidationSplit,
};
use glimpse_training::linear::ReducedBasis;
use glimpse_training::meta::learned::LearnedFit;
use glimpse_training::recipe::{RecipeFile, packed_fit, packed_pattern};
use serde_json::{Value, json};

use super::{Folder, number, numbers};
use crate::common::assert_names;

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
fn with_statements(bare: RecipeParts<'_>) -> RecipeParts<'_> {
    RecipeParts {
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
        expectation: Some(ExpectedLoss {
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

/// A recipe of all that can be stated.
pub(crate) fn stated() -> RecipeFile {
    write(reduced(), with_statements).expect("it is a recipe")
}

fn write(
    reduced: ReducedBasis,
    state: fn(RecipeParts<'_>) -> RecipeParts<'_>,
) -> Result<RecipeFile, RecipeError> {
    packed_fit(&LearnedFit::Ridge(reduced), |fit| {
        RecipeFile::write(&state(RecipeParts::new(&packed_pattern(&pattern()), fit)))
    })
}

#[test]
fn a_linear_recipe_is_shown_and_exported() {
    let folder = Folder::new();
    let mut unequal = reduced();
    unequal.precision[1] = 4.0;
    unequal.basis_checksum = 0;
    for (name, reduced) in [("equal", reduced()), ("unequal", unequal)] {
        let file = write(reduced.clone(), with_statements).expect("it is a recipe");
        folder.write(&format!("{name}.recipe"), file.bytes());
        let recipe = file.recipe();
        assert!(recipe.pattern().eq(pattern()));
        let ridge = recipe.ridge().expect("a ridge");
        assert!(ridge.basis().iter().eq(reduced.basis));
        assert!(ridge.precision().iter().eq(reduced.precision));
        for format in ["json", "rust", "postcard"] {
            folder.succeed(&format!(
                "export {name}.recipe --format {format} --out {name}.{format}"
            ));
        }
        assert_eq!(folder.read(&format!("{name}.postcard")), file.bytes());
    }

    let json = folder.read_json("equal.json");
    let expected = reduced();
    let bytes = folder.read("equal.recipe");
    let recipe = Recipe::parse(&bytes).expect("it is a recipe");
    for (field, expected) in [
        ("/model", json!("linear")),
        ("/samples", json!(3)),
        ("/eta", json!(40.0)),
        ("/basis_checksum", json!("0123abcd")),
        ("/checksum", json!(format!("{:08x}", recipe.checksum()))),
        ("/provenance/data", json!("procedural:7")),
        ("/provenance/options", json!("no options")),
        ("/noise/levels", json!(4096)),
        ("/expectation/on", json!("materials of nowhere")),
        (
            "/materials/3",
            json!({"name": "teflon", "digest": "ffffffff"}),
        ),
        (
            "/limits",
            json!({"max_theta_i": 1.25, "max_theta_o": 1.5, "min_separation": 0.125, "in_plane": true}),
        ),
        (
            "/training",
            json!({
                "schedule": "joint",
                "effort": "quick",
                "parts": "all",
                "split": "left-out",
                "digest": "0123456789abcdef",
                "sources": [
                    {"label": "procedural:7", "origin": "built-in", "materials": 7, "share": 1.0},
                ],
            }),
        ),
    ] {
        assert_eq!(json.pointer(field), Some(&expected), "{field}");
    }
    assert_eq!(number(&json["expected_loss"]) as f32, 0.0125);
    let error = &json["expectation"]["standard_error"];
    assert_eq!(number(error) as f32, 0.0015);
    assert_eq!(numbers(&json["pattern"][1]), [0.2, 0.2, 1.0]);
    assert_eq!(json["basis"].as_array().map(Vec::len), Some(3));
    assert_eq!(numbers(&json["basis"][1]), [0.25, 8.0]);
    assert_eq!(numbers(&json["mean"]), expected.mean);
    assert_eq!(numbers(&json["median"]), expected.median);
    assert_eq!(numbers(&json["weight"]), expected.weight);
    for absent in ["precision", "initial"] {
        assert_eq!(json.get(absent), None, "{absent}");
    }

    let json = folder.read_json("unequal.json");
    assert_eq!(json.get("eta"), None);
    assert_eq!(numbers(&json["precision"]), [40.0, 4.0]);
    assert_eq!(json["basis_checksum"], Value::Null);

    let rust = folder.read_text("equal.rust");
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

    let shown = folder.succeed("inspect equal.recipe");
    let figures = [
        "2", "40", "0123abcd", "0.0125", "0.0015", "7", "71.6", "85.9", "7.2", "0.02", "0.001",
        "4096", "4",
    ];
    assert_names(&shown, &figures);
    let names = ["linear", "procedural:7", "brass", "felt", "silk"];
    assert_names(&shown, &names);
    let shown = folder.succeed("inspect unequal.recipe");
    assert_names(&shown, &["4.00e0", "4.00e1"]);
}

#[test]
fn a_recipe_that_states_nothing_is_shown_and_exported() {
    let file = write(reduced(), |bare| bare).expect("it is a recipe");
    let folder = Folder::with("bare.recipe", file.bytes());
    folder.succeed("inspect bare.recipe");
    for format in ["json", "rust"] {
        folder.succeed(&format!(
            "export bare.recipe --format {format} --out {format}"
        ));
    }
    let json = folder.succeed_as_json("inspect bare.recipe");
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
    let folder = Folder::with("linear.recipe", stated().bytes());
    for method in ["ours", "meta"] {
        let evaluate =
            format!("evaluate --recipe linear.recipe --method {method} --test procedural:2");
        folder.fail_naming(&evaluate, &["linear.basis"]);
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
