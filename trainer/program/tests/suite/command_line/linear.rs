//! Recipes of the model Linear on the command line.

use glimpse_core::geometry::Angles;
use glimpse_core::gonio::Limits;
use glimpse_core::recipe::Recipe;
use glimpse_materials::{Identity, Source, SourceShare};
use glimpse_training::meta::expected_loss::{LossEstimate, ValidatedLoss, ValidationSplit};
use glimpse_training::meta::learned::{LearnedFit, LearnedRidge};
use glimpse_training::meta::plan::TrainedParts;
use glimpse_training::meta::plan::{Effort, Schedule};
use glimpse_training::meta::tasks::task::Noise;
use glimpse_training::recipe::{Metadata, RecipeFile, Training, pack_fit};
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

/// The basis of a recipe, reduced to the directions of [`pattern`].
fn reduced_basis() -> LearnedRidge {
    LearnedRidge {
        center: vec![-0.5, 0.0, 0.5],
        rows: vec![1.5, -2.0, 0.25, 8.0, 3.0, -0.1],
        precision: vec![40.0; 2],
        difference_precision: Vec::new(),
        noise_variance: None,
        basis_checksum: 0x0123_abcd,
    }
}

/// All metadata that a recipe can have.
fn metadata() -> Metadata {
    Metadata {
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
        scan_budget: None,
        expected_loss: Some(ValidatedLoss {
            estimate: LossEstimate {
                loss: 0.0125,
                standard_error: Some(0.0015),
                materials: 7,
            },
            split: ValidationSplit::LeftOut,
        }),
        training: Some(Training {
            trainer: "test".into(),
            data: "procedural:7".into(),
            materials: 7,
            sources: vec![SourceShare::single(&Source("procedural:7".into()), 7)],
            schedule: Schedule::Paper,
            effort: Effort::Quick,
            parts: TrainedParts::AllTwice,
            options: "no options".into(),
            seed: 5,
            digest: 0x0123_4567_89ab_cdef,
        }),
        materials: [("brass", 1), ("felt", 2), ("silk", 3), ("teflon", u32::MAX)]
            .map(|(name, digest)| Identity {
                name: name.into(),
                digest,
            })
            .into(),
    }
}

/// A recipe with all metadata that a recipe can have.
pub(crate) fn recipe_with_metadata() -> RecipeFile {
    let fit = LearnedFit::Ridge {
        net: None,
        ridge: reduced_basis(),
        refinement: None,
    };
    let metadata = metadata();
    let expected_loss = metadata.expected_loss.map(|each| each.estimate.loss);
    let file = pack_fit(&fit, &pattern(), expected_loss).expect("a valid recipe");
    file.with_metadata(&metadata).expect("a valid recipe")
}

#[test]
fn inspects_and_exports_linear_recipe() {
    let folder = Folder::new();
    let expected = reduced_basis();
    let file = recipe_with_metadata();
    folder.write("equal.recipe", file.bytes());
    assert!(file.recipe().pattern().eq(pattern()));
    for format in ["json", "postcard"] {
        let export = format!("export equal.recipe --format {format} --out equal.{format}");
        folder.succeed(&export);
    }
    assert_eq!(folder.read("equal.postcard"), file.bytes());

    let json = folder.read_json("equal.json");
    let bytes = folder.read("equal.recipe");
    let recipe = Recipe::parse(&bytes).expect("a valid recipe");
    for (field, expected) in [
        ("/model", json!("linear")),
        ("/samples", json!(3)),
        ("/precision", json!(expected.precision)),
        ("/basis_checksum", json!("0123abcd")),
        ("/checksum", json!(format!("{:08x}", recipe.checksum()))),
        ("/scan_time", Value::Null),
        ("/expectation/split", json!("left-out")),
        ("/noise/levels", json!(4096)),
        (
            "/expectation/on",
            json!("materials of procedural:7 that it was trained on, each with a basis of others"),
        ),
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
                "trainer": "test",
                "data": "procedural:7",
                "materials": 7,
                "schedule": "paper",
                "effort": "quick",
                "parts": "all-twice",
                "options": "no options",
                "seed": 5,
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
    assert_eq!(numbers(&json["centre"]), expected.center);
    assert_eq!(json.get("initial"), None);

    let printed = folder.succeed("inspect equal.recipe");
    let figures = [
        "2", "0.0125", "0.0015", "7", "71.6", "85.9", "7.2", "0.02", "0.001", "4096", "4",
    ];
    assert_names(&printed, &figures);
    let names = ["linear", "ridge", "procedural:7", "brass", "felt", "silk"];
    assert_names(&printed, &names);
}

#[test]
fn rejects_evaluation_without_basis() {
    let folder = Folder::with("linear.recipe", recipe_with_metadata().bytes());
    let evaluate = "evaluate --recipe linear.recipe --test procedural:2";
    folder.fail_naming(evaluate, &["linear.basis"]);
}
