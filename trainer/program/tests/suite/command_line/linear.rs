//! Recipes of the model Linear on the command line.

use glimpse_core::fit::Ridge;
use glimpse_core::model::ModelKind;
use glimpse_core::numeric::{Floats, PackedRows};
use glimpse_core::recipe::{Contents, Pattern};
use glimpse_fitting::recipe::expected_loss::{LossEstimate, ValidatedLoss, ValidationSplit};
use glimpse_fitting::recipe::options::{Effort, Schedule, TrainingOptions};
use glimpse_fitting::recipe::{Metadata, RecipeFile, Training};
use glimpse_fitting::route::LimitArgs;
use glimpse_materials::{Identity, Source, SourceShare};
use serde_json::{Value, json};

use super::{Folder, number, numbers};
use crate::common::assert_names;

/// The angles of three samples.
const PATTERN: [[f32; 3]; 3] = [[0.1, 0.2, 1.0], [0.2, 0.2, 1.0], [0.3, 0.2, 1.0]];
/// The precision of both components.
const PRECISION: [f32; 2] = [40.0; 2];
const CENTER: [f32; 3] = [-0.5, 0.0, 0.5];
const ROWS: [f32; 6] = [1.5, -2.0, 0.25, 8.0, 3.0, -0.1];
const BASIS_CHECKSUM: u32 = 0x0123_abcd;

/// All metadata that a recipe can have.
fn metadata() -> Metadata {
    Metadata {
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
            options: TrainingOptions {
                source_shares: vec![SourceShare::single(&Source("procedural:7".into()), 7)],
                noise: 0.02,
                additive: 0.01,
                levels: 4096,
                limits: LimitArgs {
                    max_theta_i: Some(71.5),
                    max_theta_o: Some(86.0),
                    min_separation: Some(7.25),
                    in_plane: true,
                },
                ..TrainingOptions::new(ModelKind::Linear, 3, Schedule::Prior, Effort::Quick, 5)
            },
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
    let lists = [PATTERN.as_flattened(), &PRECISION, &CENTER, &ROWS];
    let lists = lists.map(|list| list.iter().copied().flat_map(f32::to_le_bytes));
    let [directions, precision, center, rows] = lists.map(Iterator::collect::<Vec<u8>>);
    let metadata = metadata();
    let file = RecipeFile::write(&Contents {
        pattern: Some(Pattern {
            directions: Floats::new(&directions),
            is_path: false,
            expected_loss: metadata.expected_loss.map(|loss| loss.estimate.loss),
        }),
        ridge: Some(Ridge {
            precision: Floats::new(&precision),
            difference_precision: Floats::default(),
            center: Floats::new(&center),
            rows: PackedRows {
                entries: &rows,
                scales: Floats::default(),
            },
            basis_checksum: BASIS_CHECKSUM,
        }),
        metadata: &metadata.to_bytes(),
        ..Contents::default()
    });
    file.expect("a valid recipe")
}

#[test]
fn inspects_and_exports_linear_recipe() {
    let folder = Folder::new();
    let file = recipe_with_metadata();
    folder.write("equal.recipe", file.bytes());
    for format in ["json", "postcard"] {
        let export = format!("export equal.recipe --format {format} --out equal.{format}");
        folder.succeed(&export);
    }
    assert_eq!(folder.read("equal.postcard"), file.bytes());

    let checksum = format!("{:08x}", file.recipe().checksum());
    let json = folder.read_json("equal.json");
    for (field, expected) in [
        ("/model", json!("linear")),
        ("/samples", json!(3)),
        ("/checksum", json!(checksum)),
        ("/pattern/is_path", json!(false)),
        ("/ridge/difference_precision", json!([])),
        ("/ridge/basis_checksum", json!(BASIS_CHECKSUM)),
        ("/net", Value::Null),
    ] {
        assert_eq!(json.pointer(field), Some(&expected), "{field}");
    }
    for (list, expected) in [
        (&json["pattern"]["directions"], PATTERN.as_flattened()),
        (&json["ridge"]["precision"], &PRECISION),
        (&json["ridge"]["center"], &CENTER),
        (&json["ridge"]["rows"], &ROWS),
    ] {
        assert_eq!(numbers(list), expected);
    }
    assert_eq!(number(&json["pattern"]["expected_loss"]) as f32, 0.0125);
    let exported: Metadata = serde_json::from_value(json["metadata"].clone()).expect("metadata");
    assert_eq!(exported, metadata());

    let printed = folder.succeed("inspect equal.recipe");
    let figures = [
        "2",
        "0.0125",
        "0.0015",
        "7",
        "71.5",
        "86",
        "7.2",
        "0.02",
        "0.0031830987",
        "4096",
        "4",
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
