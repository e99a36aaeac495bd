//! Tests of the command line: output, exit codes and messages.
//!
//! Tests look for options, files, columns and numbers in messages, not for their wording. The exit
//! code is 2 for an invalid command line, and 1 for all other failures.

mod any;
mod bands;
mod basis;
mod bundled;
mod compare;
mod convert;
mod evaluate;
mod fit;
mod folder;
mod instruments;
mod interruption;
mod next;
mod option_pairs;
mod options;
mod output;
mod plan;
mod prior;
mod query;
mod quickstart;
mod recipes;
mod render;
mod reproduce;
mod scan_time;
mod shared;
mod view;

use glimpse_core::fit::Estimator;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Recipe;
use glimpse_evaluation::evaluation::names;
use glimpse_fitting::recipe::Metadata;
use glimpse_fitting::recipe::expected_loss::ValidationSplit;
use glimpse_fitting::recipe::options::{Effort, Schedule, TrainingOptions};
use glimpse_materials::{Identity, Material, Procedural, Source, SourceShare, digest};
use serde_json::{Value, json};

use crate::common::assert_names;
use folder::Folder;
use shared::{PHONG, TRAIN};

/// A number in JSON.
fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

/// A list of numbers in JSON, as the f32 that they were written from.
fn numbers(list: &Value) -> Vec<f32> {
    let list = list.as_array().expect("a list").iter();
    list.map(|value| number(value) as f32).collect()
}

#[test]
fn trains_inspects_exports_and_evaluates() {
    let folder = Folder::new();
    PHONG.copy_to(folder.path());
    assert_eq!(
        folder.names(""),
        ["phong.recipe"],
        "a finished run writes more than the recipe"
    );
    let bytes = folder.read("phong.recipe");
    let recipe = Recipe::parse(&bytes).expect("a valid recipe");
    assert_eq!((recipe.model().name(), recipe.samples()), ("phong", 4));
    let metadata = Metadata::of(&recipe).expect("valid metadata");
    let training = metadata.training.expect("stated training");
    assert_eq!(
        (&training.data[..], training.materials),
        ("procedural:12", 12)
    );
    let defaults = TrainingOptions {
        source_shares: vec![SourceShare::single(&Source("procedural:12".into()), 12)],
        ..TrainingOptions::new(ModelKind::Phong, 4, Schedule::Paper, Effort::Brief, 0)
    };
    assert_eq!(training.options, defaults);
    let expected = metadata.expected_loss.expect("a stated loss");
    assert_eq!(expected.split, ValidationSplit::HeldOut);
    // One of twelve materials is held out; a single material has no standard error.
    assert_eq!(
        (
            expected.estimate.materials,
            expected.estimate.standard_error
        ),
        (1, None)
    );
    let materials = Procedural::set(12, 0);
    let identities = materials.iter().map(|material| Identity::new(material));
    assert!(metadata.materials.into_iter().eq(identities));

    // The same seed gives the same bytes on any number of threads.
    let again = TRAIN.replace("phong.recipe", "again.recipe");
    for threads in [1, 7] {
        folder.succeed(&format!("{again} --threads {threads} --force"));
        assert_eq!(folder.read("again.recipe"), bytes, "{threads} threads");
    }

    let printed = folder.succeed("inspect phong.recipe");
    assert_names(&printed, &["phong", "7", "procedural:12", "12"]);
    let words = recipe.memory_words();
    assert_names(&printed, &[&format!("memory         {words} words\n")]);
    let as_json = folder.succeed_as_json("inspect phong.recipe");
    assert_eq!(as_json["memory_words"], words);
    assert_names(&printed, &[materials[0].name(), materials[2].name()]);

    for (format, file) in [("postcard", "copy.recipe"), ("json", "p.json")] {
        folder.succeed(&format!(
            "export phong.recipe --format {format} --out {file}"
        ));
    }
    assert_eq!(folder.read("copy.recipe"), bytes);
    let json = folder.read_json("p.json");
    assert_eq!(as_json, json);
    let Estimator::Sgd(sgd) = recipe.estimator() else {
        panic!("{recipe:?}");
    };
    let first = recipe.pattern().next().expect("a sample");
    assert!(sgd.initial.iter().eq(numbers(&json["sgd"]["initial"])));
    assert!(
        sgd.step_sizes
            .iter()
            .eq(numbers(&json["sgd"]["step_sizes"]))
    );
    assert_eq!(numbers(&json["pattern"]["directions"])[2], first.phi_d);
    for (field, expected) in [
        ("/samples", json!(4)),
        ("/sgd/steps", json!(20)),
        (
            "/metadata/expected_loss/estimate/loss",
            json["pattern"]["expected_loss"].clone(),
        ),
        ("/metadata/training/options/effort", json!("brief")),
        ("/metadata/materials/3/digest", json!(digest(&materials[3]))),
    ] {
        assert_eq!(json.pointer(field), Some(&expected), "{field}");
    }

    let report = folder.succeed_as_json("evaluate --recipe phong.recipe --test procedural:2:9");
    assert_eq!(report["method"], names::PAPER);
    assert_eq!(report["materials"].as_array().expect("a list").len(), 2);
    for metric in ["loss", "dssim", "l2", "psnr", "delta_e"] {
        let mean = number(&report[metric]);
        let values = [0, 1].map(|i| number(&report["materials"][i][metric]));
        assert!(
            (mean - (values[0] + values[1]) / 2.0).abs() < 1e-9,
            "{metric}"
        );
    }
}

#[test]
fn strip_removes_metadata() {
    let folder = Folder::new();
    PHONG.copy_to(folder.path());
    let strip = |format: &str, out: &str| {
        format!("export phong.recipe --format {format} --strip --out {out}")
    };
    folder.succeed(&strip("postcard", "flash.recipe"));
    let bytes = folder.read("flash.recipe");
    let flash = Recipe::parse(&bytes).expect("a valid recipe");
    let whole = folder.read("phong.recipe");
    let whole = Recipe::parse(&whole).expect("a valid recipe");
    assert!(!whole.metadata().is_empty() && flash.metadata().is_empty());
    assert_eq!(flash.expected_loss(), whole.expected_loss());
    assert!(flash.pattern().eq(whole.pattern()) && flash.values() == whole.values());
    let printed = folder.succeed_as_json("inspect flash.recipe");
    assert_eq!(printed["metadata"], json!(Metadata::default()));
    folder.succeed("inspect flash.recipe");

    // The C header has the same bytes.
    folder.succeed(&strip("c", "flash.h"));
    let source = folder.read_text("flash.h");
    let (_, array) = source.split_once("= {").expect("an array");
    let listed = array.split(',').filter_map(|byte| {
        let byte = byte.trim().strip_prefix("0x")?;
        Some(u8::from_str_radix(byte, 16).expect("a byte"))
    });
    assert!(listed.eq(bytes.iter().copied()));
    let declared = format!("glimpse_recipe_bytes[{}]", bytes.len());
    assert!(source.contains(&declared), "{source}");

    folder.fail_naming(&strip("json", "out"), &["--strip", "postcard"]);
    assert!(!folder.exists("out"));
}
