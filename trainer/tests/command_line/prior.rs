//! Schedule prior, as a user meets it.

use glimpse_core::recipe::Recipe;
use serde_json::Value;

use super::common::assert_names;
use super::{fail_naming, succeed, succeed_as_json};

#[test]
fn a_recipe_that_completes_is_trained_shown_exported_and_judged() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    for model in ["linear", "phong"] {
        let name = format!("{model}.recipe");
        let train = ["train", "--model", model, "--samples", "3"];
        let rest = [
            "--effort",
            "brief",
            "--data",
            "procedural:9:1",
            "--data",
            "procedural:3:2",
            "--share",
            "2,8",
            "--missing",
            "0.5",
            "--noise",
            "0.02",
            "--additive",
            "0.01",
            "--levels",
            "4096",
            "--max-theta-i",
            "70",
            "--min-separation",
            "10",
        ];
        let arguments = [&train[..], &rest, &["--out", &name]].concat();
        succeed(directory, &arguments);

        let shown = succeed(directory, &["inspect", &name]);
        let figures = [
            "3", "24", "64", "0.5", "0.02", "0.01", "4096", "0.4", "70.0", "90.0", "10.0", "12",
            "0.200", "0.800",
        ];
        assert_names(&shown, &figures);
        assert_names(&shown, &["procedural:9:1", "procedural:3:2"]);

        let json = format!("{model}.json");
        succeed(
            directory,
            &["export", &name, "--format", "json", "--out", &json],
        );
        let text = std::fs::read_to_string(directory.join(&json)).expect("it was written");
        let value: Value = serde_json::from_str(&text).expect("it is JSON");
        let completion = &value["completion"];
        let length = |value: &Value| value.as_array().map_or(0, Vec::len);
        assert_eq!(length(&completion["readings"]), 3);
        assert_eq!(length(&completion["readings"][0]["missing"]), 88);
        assert_eq!(length(&completion["output"]), 24);
        assert_eq!(length(&value["prediction"]), 25);
        match model {
            "phong" => assert_eq!(length(&value["start"]["output"]), 7),
            _ => assert_eq!(length(&value["basis"]), 3),
        }
        let rust = format!("{model}.rs");
        succeed(
            directory,
            &["export", &name, "--format", "rust", "--out", &rust],
        );
        let source = std::fs::read_to_string(directory.join(&rust)).expect("it was written");
        for list in ["READINGS: [i8; 792]", "PREDICTION: [f32; 25]"] {
            assert!(source.contains(&format!("pub const {list}")), "{source}");
        }

        let evaluate = [
            "evaluate",
            "--recipe",
            &name,
            "--test",
            "procedural:1:77",
            "--json",
        ];
        let verdict = succeed_as_json(directory, &evaluate);
        assert_eq!(verdict["method"], "completed");
        let loss = verdict["loss"].as_f64().expect("a loss");
        assert!((0.001..0.08).contains(&loss), "{model}: {loss}");

        // What is predicted stands beside it, and is another loss from fewer readings.
        let predicted = |verdict: &Value| {
            let each = verdict["materials"][0]["predicted_loss"].as_f64();
            let mean = verdict["prediction"]["loss"].as_f64();
            [each, mean].map(|loss| loss.expect("a loss"))
        };
        let few = [&evaluate[..], &["--first", "2", "--noise", "0.02"]].concat();
        let few = succeed_as_json(directory, &few);
        for (all, few) in predicted(&verdict).into_iter().zip(predicted(&few)) {
            assert!((0.0005..0.1).contains(&all) && all != few, "{all} {few}");
        }
        assert_ne!(few["loss"], verdict["loss"]);
        assert_eq!((&verdict["seeds"], &few["seeds"]), (&1.into(), &5.into()));
        let text = succeed(directory, &evaluate[..evaluate.len() - 1]);
        let [_, mean] = predicted(&verdict);
        assert_names(&text, &[&format!("{mean:.4}")]);

        // All of its directions are where the machine gets to.
        let recipe = std::fs::read(directory.join(&name)).expect("it was written");
        let recipe = Recipe::parse(&recipe).expect("it is a recipe");
        let limits = recipe.statements().expect("they make sense").limits;
        let limits = limits.expect("they are stated");
        assert_eq!(recipe.out_of_reach(&limits), None);
        assert!((limits.min_separation.to_degrees() - 10.0).abs() < 1e-4);
    }
}

#[test]
fn options_of_schedule_prior_are_refused_where_they_have_no_effect() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let train = [
        "train",
        "--model",
        "linear",
        "--samples",
        "3",
        "--out",
        "x.recipe",
    ];
    for (arguments, named) in [
        (
            &["--schedule", "joint", "--missing", "0.5"][..],
            "--missing",
        ),
        (&["--schedule", "paper", "--noise", "0.02"], "--noise"),
        (
            &["--schedule", "joint", "--procedural", "0"],
            "--procedural",
        ),
        (
            &["--schedule", "joint", "--max-theta-o", "80"],
            "--max-theta-o",
        ),
        (&["--schedule", "joint", "--levels", "256"], "--levels"),
        (&["--data", "procedural:2", "--share", "1"], "--share"),
        (
            &[
                "--data",
                "procedural:2",
                "--data",
                "procedural:2:1",
                "--share",
                "1",
            ],
            "--share",
        ),
        (
            &[
                "--data",
                "procedural:2",
                "--data",
                "procedural:2:1",
                "--share",
                "1,0",
            ],
            "--share",
        ),
        (
            &["--data", "procedural:2", "--data", "procedural:3"],
            "procedural:3",
        ),
        (&["--bases", "5"], "--bases"),
        (
            &["--max-theta-i", "20", "--min-separation", "50"],
            "--min-separation",
        ),
        (&["--max-theta-i", "120"], "--max-theta-i"),
        (&["--schedule", "prior", "--missing", "1.5"], "--missing"),
    ] {
        fail_naming(scratch.path(), &[&train[..], arguments].concat(), &[named]);
    }
}

#[test]
fn readings_are_lost_where_a_recipe_can_do_without_them() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let recipe = |name: &str| {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/recipes/");
        format!("{folder}{name}")
    };
    let (all, masked) = (
        recipe("completed/phong-n8.recipe"),
        recipe("masked/neural-n16.recipe"),
    );
    for (recipe, arguments, named) in [
        (&all, &["--first", "4"][..], &["--missing"][..]),
        (&all, &["--lose", "1"], &["--missing"]),
        (
            &masked,
            &["--first", "2", "--lose", "2"],
            &["--first", "--lose", "2"],
        ),
        (
            &masked,
            &["--method", "meta", "--noise", "0.1"],
            &["--noise", "--method", "meta"],
        ),
    ] {
        let evaluate = ["evaluate", "--recipe", recipe, "--test", "procedural:2:9"];
        fail_naming(scratch.path(), &[&evaluate[..], arguments].concat(), named);
    }
    let loss = |arguments: &[&str]| {
        let evaluate = [
            "evaluate",
            "--recipe",
            &masked,
            "--test",
            "procedural:1:9",
            "--json",
        ];
        let verdict = succeed_as_json(scratch.path(), &[&evaluate[..], arguments].concat());
        verdict["loss"].as_f64().expect("a loss")
    };
    let [all, eight, one] = [&[][..], &["--first", "8"], &["--first", "1"]].map(loss);
    println!("16 readings {all:.4}, 8 {eight:.4}, 1 {one:.4}");
    assert!(all < eight && eight < one && one < 0.1);
    let [coarse, fine] = [&["--levels", "20"][..], &["--levels", "100000"]].map(loss);
    println!("20 levels {coarse:.4}, 100,000 {fine:.4}");
    assert!(all < coarse && coarse < 0.1 && (fine / all - 1.0).abs() < 0.02);
}

/// A map that always sees many readings learns the training's materials by heart.
#[test]
fn of_many_readings_some_may_be_missing_unless_it_is_asked_otherwise() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    for (samples, more, takes_missing) in [
        ("32", &[][..], false),
        ("33", &[][..], true),
        ("33", &["--missing", "0"][..], false),
    ] {
        let train = ["train", "--model", "linear", "--samples", samples];
        let rest = ["--effort", "brief", "--data", "procedural:3:1"];
        let out = ["--out", "many.recipe", "--force"];
        succeed(directory, &[&train[..], &rest, &out, more].concat());
        let bytes = std::fs::read(directory.join("many.recipe")).expect("it was written");
        let recipe = Recipe::parse(&bytes).expect("it is whole");
        assert_eq!(recipe.learner().takes_missing(), takes_missing, "{more:?}");
    }
}
