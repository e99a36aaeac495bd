//! `trainer evaluate`: how far its numbers can be relied on.

use std::fs;
use std::path::Path;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::recipe::{Ingredients, Recipe};
use glimpse_materials::loss::mean_log_error;
use glimpse_materials::{Material, Procedural, Source, digest};
use glimpse_trainer::evaluation::Method;
use glimpse_training::recipe::{RecipeFile, packed_pattern};
use serde_json::{Value, json};

use super::common::assert_names;
use super::shared::LINEAR_N2;
use super::{TRAIN, fail_naming, succeed, succeed_as_json, trainer};

const PHONG: &[u8] = include_bytes!("../../../core/examples/recipes/phong-n8.recipe");
const NEURAL: &[u8] = include_bytes!("../../../core/examples/recipes/neural-n8.recipe");
const COOK_TORRANCE: &[u8] =
    include_bytes!("../../../core/examples/recipes/cook-torrance-n8.recipe");

fn folder() -> tempfile::TempDir {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    for (name, bytes) in [
        ("phong.recipe", PHONG),
        ("neural.recipe", NEURAL),
        ("cook-torrance.recipe", COOK_TORRANCE),
    ] {
        fs::write(scratch.path().join(name), bytes).expect("it is written");
    }
    scratch
}

fn as_json(directory: &Path, arguments: &[&str]) -> Value {
    succeed_as_json(directory, &[&["evaluate", "--json"], arguments].concat())
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

/// The digits of a number behind the point, in reverse.
fn radical_inverse(mut number: u32, base: u32) -> f64 {
    let (mut inverse, mut place) = (0.0, 1.0);
    while number > 0 {
        place /= f64::from(base);
        inverse += place * f64::from(number % base);
        number /= base;
    }
    inverse
}

#[test]
fn the_seed_moves_no_mean_and_the_mean_is_that_of_all_directions() {
    let scratch = folder();
    let materials = Source("procedural:4:3".into()).load().expect("they load");
    // Other directions, many more: Hammersley's points.
    const MANY: u32 = 1 << 18;
    let at: Vec<HalfDifference<f32>> = (0..MANY)
        .map(|index| {
            let share = [
                (f64::from(index) + 0.5) / f64::from(MANY),
                radical_inverse(index, 2),
                radical_inverse(index, 3),
            ];
            let ends = [0.5, 0.5, 2.0].map(|end| end * std::f64::consts::PI);
            let [theta_h, theta_d, phi_d] = [0, 1, 2].map(|i| (share[i] * ends[i]) as f32);
            HalfDifference::from_angles(Angles {
                theta_h,
                theta_d,
                phi_d,
            })
        })
        .filter(HalfDifference::is_valid)
        .collect();
    let recipes = ["phong.recipe", "neural.recipe", "cook-torrance.recipe"];
    let judge = |test, seed| {
        let arguments = [
            &["--recipe"],
            &recipes[..],
            &["--test", test, "--seed", seed],
        ];
        as_json(scratch.path(), &arguments.concat())
    };
    assert_eq!(judge("procedural:1:3", "0"), judge("procedural:1:3", "1"));
    let judged = judge("procedural:4:3", "0");
    for (index, bytes) in [PHONG, NEURAL, COOK_TORRANCE].into_iter().enumerate() {
        let recipe = Recipe::parse(bytes).expect("it is a recipe");
        let method = Method::ours(&recipe, None).expect("it needs no basis");
        let losses = materials.iter().map(|material| {
            let fitted = method.fit(&**material, 0).expect("it fits");
            let mut reference = vec![[0.0; 3]; at.len()];
            material.brdf_batch(&at, &mut reference);
            mean_log_error(&fitted, &at, &reference)
        });
        let expected = losses.sum::<f64>() / materials.len() as f64;
        let loss = number(&judged["recipes"][index]["loss"]);
        println!(
            "{}: {loss:.6}, of many more directions {expected:.6}",
            recipes[index]
        );
        assert!((loss / expected - 1.0).abs() < 0.01, "{loss}, {expected}");
    }
}

#[test]
fn the_standard_error_is_over_the_materials() {
    let scratch = folder();
    let arguments = ["--recipe", "phong.recipe", "--test", "procedural:3:3"];
    let judged = as_json(scratch.path(), &arguments);
    let materials = judged["materials"].as_array().expect("a list");
    let losses: Vec<f64> = materials.iter().map(|each| number(&each["loss"])).collect();
    let mean = losses.iter().sum::<f64>() / 3.0;
    let squares: f64 = losses.iter().map(|loss| (loss - mean).powi(2)).sum();
    let expected = (squares / 2.0 / 3.0).sqrt();
    let found = number(&judged["loss_standard_error"]);
    assert!((found / expected - 1.0).abs() < 1e-9, "{found}, {expected}");
    // One material has none.
    let single = ["--recipe", "phong.recipe", "--test", "procedural:1:3"];
    let judged = as_json(scratch.path(), &single);
    assert_eq!(judged["loss_standard_error"], Value::Null);
}

#[test]
fn recipes_are_compared_pair_by_pair() {
    let scratch = folder();
    let arguments = [
        "--recipe",
        "phong.recipe",
        "neural.recipe",
        "cook-torrance.recipe",
        "--test",
        "procedural:2:3",
    ];
    let all = as_json(scratch.path(), &arguments);
    let losses = |index: usize| -> Vec<f64> {
        let materials = all["recipes"][index]["materials"]
            .as_array()
            .expect("a list");
        materials.iter().map(|each| number(&each["loss"])).collect()
    };
    // Each is judged as it is alone.
    let alone = as_json(
        scratch.path(),
        &["--recipe", "neural.recipe", "--test", "procedural:2:3"],
    );
    assert_eq!(all["recipes"][1], alone);
    let first = losses(0);
    for (index, name) in [(1, "neural.recipe"), (2, "cook-torrance.recipe")] {
        let difference = &all["differences"][index - 1];
        assert_eq!(difference["recipe"], name);
        assert_eq!(difference["base"], "phong.recipe");
        let pairs: Vec<f64> = losses(index)
            .iter()
            .zip(&first)
            .map(|(a, b)| a - b)
            .collect();
        let mean = pairs.iter().sum::<f64>() / 2.0;
        let squares: f64 = pairs.iter().map(|pair| (pair - mean).powi(2)).sum();
        let error = (squares / 1.0 / 2.0).sqrt();
        assert!((number(&difference["loss"]) - mean).abs() < 1e-12);
        assert!((number(&difference["standard_error"]) - error).abs() < 1e-12);
        let less = pairs.iter().filter(|pair| **pair < 0.0).count();
        assert_eq!(difference["less_loss_on"], json!(less));
    }
    let text = succeed(scratch.path(), &[&["evaluate"], &arguments[..]].concat());
    let row = text
        .lines()
        .find(|line| line.starts_with("cook-torrance.recipe"));
    let row = row.expect("a row");
    for field in ["loss", "standard_error"] {
        let figure = format!("{:.4}", number(&all["differences"][1][field]));
        assert_names(row, &[&figure]);
    }
    let materials = Procedural::set(2, 3);
    assert_names(&text, &[materials[0].name(), materials[1].name()]);
}

/// A recipe of Linear that says it was trained on these, with the basis of one that was.
fn that_knows(directory: &Path, materials: &[(&str, u32)]) {
    LINEAR_N2.copy_to(directory);
    let file = RecipeFile::read(&directory.join("linear-n2.recipe")).expect("it is a recipe");
    let recipe = file.recipe();
    let pattern: Vec<_> = recipe.pattern().collect();
    let file = RecipeFile::write(&Ingredients {
        expectation: recipe.statements().expect("they make sense").expectation,
        materials,
        ..Ingredients::new(&packed_pattern(&pattern), recipe.learner().into())
    });
    let file = file.expect("it is a recipe");
    fs::write(directory.join("k.recipe"), file.bytes()).expect("it is written");
    let basis = directory.join("linear-n2.basis");
    fs::copy(basis, directory.join("k.basis")).expect("it is copied");
}

#[test]
fn materials_of_training_are_told() {
    let scratch = folder();
    let directory = scratch.path();
    let set = Procedural::set(4, 0);
    let judge = |test| as_json(directory, &["--recipe", "k.recipe", "--test", test]);

    // One under another name, one by its name only, two that are new.
    that_knows(
        directory,
        &[("another-name", digest(&set[1])), (set[2].name(), 7)],
    );
    let judged = judge("procedural:4");
    assert_eq!(judged["trained_on"], json!([set[1].name()]));
    assert_eq!(judged["namesakes_trained_on"], json!([set[2].name()]));
    let flags = [0, 1, 2, 3].map(|index| judged["materials"][index]["trained_on"].clone());
    assert_eq!(
        flags,
        [json!(false), json!(true), json!(false), json!(false)]
    );
    assert_eq!(judged["new"]["materials"], 2);
    let of = |index: usize| number(&judged["materials"][index]["loss"]);
    let new = number(&judged["new"]["loss"]);
    assert!((new - (of(0) + of(3)) / 2.0).abs() < 1e-12);

    // Text and pictures name them too, besides the rows of all materials.
    for (command, also) in [
        (&["evaluate", "--test"][..], &[][..]),
        (&["render", "sphere"], &["--size", "8"]),
    ] {
        let arguments = [command, &["procedural:2", "--recipe", "k.recipe"], also].concat();
        let output = trainer(directory, &arguments);
        assert!(output.status.success(), "{output:?}");
        let text = [output.stdout, output.stderr].concat();
        let text = String::from_utf8(text).expect("it is text");
        let times = |index: usize| text.matches(set[index].name()).count();
        assert_eq!((times(0), times(1)), (1, 2), "{text}");
    }

    // All new.
    that_knows(directory, &[("another", 1)]);
    let judged = judge("procedural:1");
    assert_eq!(judged["trained_on"], json!([]));
    assert_eq!(judged.get("new"), None);

    // A recipe that does not name its materials.
    that_knows(directory, &[]);
    let judged = judge("procedural:1");
    assert_eq!(judged["trained_on"], Value::Null);
    assert_eq!(judged["materials"][0]["trained_on"], Value::Null);

    // Of methods without a recipe, those that took components from materials.
    let random = [
        "--method",
        "random",
        "--model",
        "linear",
        "--samples",
        "4",
        "--train",
        "procedural:2",
        "--test",
        "procedural:3",
        "--seeds",
        "1",
    ];
    let judged = as_json(directory, &random);
    assert_eq!(judged["trained_on"].as_array().map(Vec::len), Some(2));
}

#[test]
fn a_promise_is_told_with_what_it_was_found_on() {
    let scratch = folder();
    let directory = scratch.path();
    let mut train = TRAIN.to_vec();
    (train[4], train[6]) = ("1", "procedural:1");
    train[10] = "one.recipe";
    let output = trainer(directory, &train);
    let talk = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{talk}");
    let shown = succeed_as_json(directory, &["inspect", "one.recipe", "--json"]);
    assert_eq!(shown["training"]["split"], "training");
    let arguments = [
        "evaluate",
        "--recipe",
        "one.recipe",
        "--test",
        "procedural:1:3",
    ];
    let judged = as_json(directory, &arguments[1..]);
    assert_eq!(judged["promise"]["materials"], 1);
    // The loss, and what it was found on, wherever the recipe is spoken of.
    let loss = format!("{:.4}", number(&judged["promise"]["loss"]));
    let shown = succeed(directory, &["inspect", "one.recipe"]);
    for text in [&*talk, &shown, &succeed(directory, &arguments)] {
        assert_names(text, &[&loss, "1", "procedural:1"]);
    }
    assert_eq!(judged["promise"]["standard_error"], Value::Null);
    // An older recipe does not say.
    let arguments = ["--recipe", "phong.recipe", "--test", "procedural:1:3"];
    let judged = as_json(directory, &arguments);
    assert_eq!(judged["promise"]["materials"], 0);
}

#[test]
fn no_more_readings_are_asked_for_than_there_are() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    succeed(directory, &["recipes", "get", "neural-n16-masked"]);
    let first = |count| {
        [
            "evaluate",
            "--recipe",
            "neural-n16-masked.recipe",
            "--test",
            "procedural:1:3",
            "--first",
            count,
        ]
    };
    fail_naming(directory, &first("17"), &["17", "16"]);
    let all = succeed(directory, &first("16"));
    assert_eq!(all, succeed(directory, &first("16")[..5]));
}

#[test]
fn both_ways_to_judge_are_offered() {
    let scratch = folder();
    for arguments in [&["evaluate"][..], &["evaluate", "--test", "procedural:1"]] {
        let output = trainer(scratch.path(), arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        let message = String::from_utf8_lossy(&output.stderr);
        for option in ["--recipe", "--method", "--model", "--samples", "--test"] {
            assert!(message.contains(option), "no {option} in {message}");
        }
    }
    let help = succeed(scratch.path(), &["evaluate", "--help"]);
    let usage: Vec<&str> = help
        .lines()
        .filter(|line| line.contains("trainer evaluate") && line.contains("[OPTIONS]"))
        .collect();
    assert!(
        usage.iter().any(|line| line.contains("--recipe"))
            && usage.iter().any(|line| line.contains("--model")),
        "{help}"
    );
    // A model is judged by a method, and not beside a recipe.
    for arguments in [
        &["--model", "phong"][..],
        &["--method", "random"],
        &["--recipe", "phong.recipe", "--model", "phong"],
    ] {
        let evaluate = ["evaluate", "--test", "procedural:1"];
        let output = trainer(scratch.path(), &[&evaluate[..], arguments].concat());
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
    }
}
