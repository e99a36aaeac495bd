//! The command line as a user meets it: what it writes, how it ends, and what its messages name.
//!
//! Messages may be worded anew: tests look for options, files, columns and numbers in them. Exit
//! code 2 is for command lines that cannot be parsed, 1 for all other failures.

mod basis;
#[path = "../common/mod.rs"]
mod common;
mod convert;
mod evaluate;
mod fit;
mod grid;
mod left_out;
mod linear;
mod list;
mod options;
mod output;
mod plan;
mod prior;
mod query;
mod quickstart;
mod recipes;
mod render;
mod reproduce;
mod shared;
mod survival;
mod view;

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use common::assert_names;
use glimpse_core::recipe::{Effort, Kind, Parts, Recipe, Schedule, ValidationSplit};
use glimpse_materials::{Material, Procedural, digest};
use serde_json::{Value, json};

fn trainer(directory: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_trainer"))
        .args(arguments)
        .current_dir(directory)
        .output()
        .expect("the trainer runs")
}

/// Runs a command that must succeed; returns its standard output.
fn succeed(directory: &Path, arguments: &[&str]) -> String {
    let output = trainer(directory, arguments);
    let talk = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {talk}");
    String::from_utf8(output.stdout).expect("it prints text")
}

/// Runs a command that must succeed; returns the JSON that it prints.
fn succeed_as_json(directory: &Path, arguments: &[&str]) -> Value {
    let printed = succeed(directory, arguments);
    serde_json::from_str(&printed).expect("it is JSON")
}

/// Runs a command that must fail by an error, which is no panic; returns the message.
fn fail(directory: &Path, arguments: &[&str]) -> String {
    let output = trainer(directory, arguments);
    let code = output.status.code();
    assert!(matches!(code, Some(1 | 2)), "{arguments:?}: {code:?}");
    assert!(
        output.stdout.is_empty(),
        "results of a failed {arguments:?}"
    );
    String::from_utf8(output.stderr).expect("it prints text")
}

/// Runs a command that must fail, and asserts that the message names these.
fn fail_naming(directory: &Path, arguments: &[&str], named: &[&str]) {
    assert_names(&fail(directory, arguments), named);
}

/// By schedule joint; `prior.rs` has the default.
const TRAIN: [&str; 13] = [
    "train",
    "--model",
    "phong",
    "--samples",
    "4",
    "--data",
    "procedural:12",
    "--effort",
    "brief",
    "--out",
    "phong.recipe",
    "--schedule",
    "joint",
];

#[test]
fn a_recipe_is_trained_shown_exported_and_judged() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    succeed(directory, &TRAIN);
    let bytes = fs::read(directory.join("phong.recipe")).expect("the recipe is there");
    let recipe = Recipe::parse(&bytes).expect("it is a recipe");
    assert_eq!((recipe.model().name(), recipe.samples()), ("phong", 4));
    let provenance = recipe
        .statements()
        .expect("they make sense")
        .provenance
        .expect("it says where it came from");
    assert_eq!(
        (provenance.data, provenance.materials),
        ("procedural:12", 12)
    );
    let training = recipe.statements().expect("they make sense").training;
    let training = training.expect("it says how it was trained");
    assert_eq!(
        (training.schedule, training.effort, training.parts),
        (Schedule::Joint, Effort::Brief, Parts::All)
    );
    assert_eq!(training.split, ValidationSplit::HeldOut);
    // Of twelve materials one is held out, and one has no standard error.
    let expectation = recipe
        .statements()
        .expect("they make sense")
        .expectation
        .expect("it promises a loss");
    assert_eq!(
        (expectation.materials, expectation.standard_error),
        (1, None)
    );
    let materials = Procedural::set(12, 0);
    let identities = materials.iter().map(|each| (each.name(), digest(each)));
    assert!(
        recipe
            .statements()
            .expect("they make sense")
            .materials
            .eq(identities)
    );
    let names = fs::read_dir(directory).expect("it can be listed");
    assert_eq!(
        names.count(),
        1,
        "a finished run leaves nothing but the recipe"
    );

    // The same seed gives the same bytes, on one thread too.
    let mut again = TRAIN.to_vec();
    again[10] = "again.recipe";
    again.extend(["--threads", "1"]);
    succeed(directory, &again);
    assert_eq!(
        fs::read(directory.join("again.recipe")).expect("it is there"),
        bytes
    );

    let shown = succeed(directory, &["inspect", "phong.recipe"]);
    assert_names(&shown, &["phong", "7", "procedural:12", "12"]);
    assert_names(&shown, &[materials[0].name(), materials[2].name()]);

    for (format, file) in [
        ("postcard", "copy.recipe"),
        ("json", "p.json"),
        ("rust", "p.rs"),
    ] {
        succeed(
            directory,
            &["export", "phong.recipe", "--format", format, "--out", file],
        );
    }
    assert_eq!(
        fs::read(directory.join("copy.recipe")).expect("it is there"),
        bytes
    );
    let json = fs::read(directory.join("p.json")).expect("it is there");
    let json: Value = serde_json::from_slice(&json).expect("it is JSON");
    assert_eq!(json["samples"], 4);
    let numbers = |field: &str| -> Vec<f32> {
        let list = json[field].as_array().expect("a list");
        list.iter()
            .map(|number| number.as_f64().expect("a number") as f32)
            .collect()
    };
    let descent = recipe.descent().expect("a descent");
    assert_eq!(
        numbers("initial"),
        descent.initial().iter().collect::<Vec<_>>()
    );
    assert_eq!(
        numbers("step_sizes"),
        descent.step_sizes().iter().collect::<Vec<_>>()
    );
    assert_eq!(json["inner_steps"], 20);
    assert_eq!(json["expectation"]["materials"], 1);
    assert_eq!(json["expectation"]["loss"], json["expected_loss"]);
    assert_eq!(json["training"]["parts"], "all");
    assert_eq!(json["materials"].as_array().map(Vec::len), Some(12));
    let digest = format!("{:08x}", digest(&materials[3]));
    assert_eq!(json["materials"][3]["digest"], digest);
    assert_eq!(
        (&json["limits"], &json["noise"]),
        (&Value::Null, &Value::Null)
    );
    let first = recipe.pattern().next().expect("a sample");
    assert_eq!(
        json["pattern"][0][2].as_f64().expect("a number") as f32,
        first.phi_d
    );
    let source = fs::read_to_string(directory.join("p.rs")).expect("it is there");
    assert!(
        source.contains("pub const PATTERN: [[f32; 3]; 4]"),
        "{source}"
    );

    let judged = succeed_as_json(
        directory,
        &[
            "evaluate",
            "--recipe",
            "phong.recipe",
            "--test",
            "procedural:2:9",
            "--json",
        ],
    );
    assert_eq!(judged["method"], "ours");
    assert_eq!(judged["materials"].as_array().expect("a list").len(), 2);
    for metric in ["loss", "dssim", "l2", "psnr", "delta_e"] {
        let mean = judged[metric].as_f64().expect("a number");
        let each = [0, 1].map(|i| judged["materials"][i][metric].as_f64().expect("a number"));
        assert!((mean - (each[0] + each[1]) / 2.0).abs() < 1e-9, "{metric}");
    }
}

#[test]
fn names_of_materials_are_left_out_for_flash() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    let whole = linear::stated();
    fs::write(directory.join("whole.recipe"), whole.bytes()).expect("it is written");
    let strip = |from, format, out| {
        let mut arguments = vec!["export", from, "--format", format, "--out", out];
        arguments.push("--strip");
        arguments
    };
    succeed(
        directory,
        &strip("whole.recipe", "postcard", "flash.recipe"),
    );
    let bytes = fs::read(directory.join("flash.recipe")).expect("it is there");
    let (flash, whole) = (
        Recipe::parse(&bytes).expect("it is a recipe"),
        whole.recipe(),
    );
    assert_eq!(
        whole
            .statements()
            .expect("they make sense")
            .materials
            .count(),
        4
    );
    assert_eq!(
        flash
            .statements()
            .expect("they make sense")
            .materials
            .count(),
        0
    );
    let others = whole
        .sections()
        .filter(|(kind, _)| *kind != Kind::MATERIALS);
    assert!(flash.sections().eq(others));
    let shown = succeed_as_json(directory, &["inspect", "flash.recipe", "--json"]);
    assert_eq!(shown["materials"], json!(null));

    // The same bytes, as C has them.
    succeed(directory, &strip("whole.recipe", "c", "flash.h"));
    let source = fs::read_to_string(directory.join("flash.h")).expect("it is there");
    let (_, array) = source.split_once("= {").expect("an array");
    let listed = array.split(',').filter_map(|byte| {
        let byte = byte.trim().strip_prefix("0x")?;
        Some(u8::from_str_radix(byte, 16).expect("a byte"))
    });
    assert!(listed.eq(bytes.iter().copied()));
    let declared = format!("glimpse_recipe_bytes[{}]", bytes.len());
    assert!(source.contains(&declared), "{source}");

    for format in ["json", "rust", "csv"] {
        fail_naming(
            directory,
            &strip("whole.recipe", format, "out"),
            &["--strip", "postcard"],
        );
        assert!(!directory.join("out").exists());
    }
}

#[test]
fn random_is_judged_without_a_recipe() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let arguments = [
        "evaluate",
        "--method",
        "random",
        "--model",
        "neural",
        "--samples",
        "8",
        "--test",
        "procedural:1:9",
        "--seeds",
        "2",
        "--json",
    ];
    let judged = succeed_as_json(scratch.path(), &arguments);
    assert_eq!(
        (&judged["method"], &judged["seeds"]),
        (&"random".into(), &2.into())
    );
    assert!(judged["loss_spread"].as_f64().expect("a number") > 0.0);
}

#[test]
fn mistakes_are_named() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    fs::write(directory.join("bad.recipe"), b"GLMQ").expect("it is written");
    fail_naming(
        directory,
        &["inspect", "bad.recipe"],
        &["bad.recipe", "GLMP"],
    );
    fail_naming(directory, &["inspect", "none.recipe"], &["none.recipe"]);
    let mut nowhere = TRAIN.to_vec();
    nowhere[6] = "nowhere";
    fail_naming(directory, &nowhere, &["nowhere"]);
    let mut none = TRAIN.to_vec();
    none[4] = "0";
    fail_naming(directory, &none, &["--samples", "0"]);
}

/// A run that is killed goes on where its last checkpoint was, to the same bytes.
#[test]
fn a_stopped_run_goes_on_to_the_same_recipe() {
    use std::ops::ControlFlow;
    use std::time::Duration;

    use glimpse_core::model::ModelKind;
    use glimpse_materials::Source;
    use glimpse_training::meta::checkpoint::CheckpointError;
    use glimpse_training::meta::options::Options;
    use glimpse_training::meta::outer::Checkpoints;
    use glimpse_training::meta::plan::{Effort, Schedule};
    use glimpse_training::meta::run::{TrainError, train};

    let scratch = tempfile::tempdir().expect("a temporary directory");
    let materials = || Source("procedural:12".into()).load().expect("materials");
    let mut options = Options::new(ModelKind::Phong, 4, Schedule::Joint, Effort::Brief, 3);
    let whole =
        train(&options, materials(), &mut |_| ControlFlow::Continue(())).expect("it is trained");
    let mut checkpoints = Checkpoints {
        directory: scratch.path().join("checkpoint"),
        every: Duration::from_secs(10),
        resume: false,
    };
    // In a phase of gradients, at the very end of one, and in two of evolution.
    for stop in [123, 300, 320, 750] {
        options.checkpoints = Some(checkpoints.clone());
        let outcome = train(&options, materials(), &mut |progress| {
            if progress.done == stop {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        });
        assert!(
            matches!(outcome, Err(TrainError::Stopped(done)) if done == stop),
            "{outcome:?}"
        );
        checkpoints.resume = true;
    }
    options.checkpoints = Some(checkpoints);
    let resumed =
        train(&options, materials(), &mut |_| ControlFlow::Continue(())).expect("it is trained");
    assert_eq!(resumed, whole);

    options.seed = 4;
    let outcome = train(&options, materials(), &mut |_| ControlFlow::Continue(()));
    assert!(
        matches!(
            outcome,
            Err(TrainError::Checkpoint(CheckpointError::OtherRun { .. }))
        ),
        "{outcome:?}"
    );
}
