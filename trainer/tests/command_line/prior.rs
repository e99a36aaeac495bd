//! Schedule prior, as a user meets it.

use serde_json::Value;

use super::{fail, succeed};

#[test]
fn a_recipe_that_completes_is_trained_shown_exported_and_judged() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    for model in ["linear", "phong"] {
        let name = format!("{model}.recipe");
        let train = [
            "train",
            "--model",
            model,
            "--samples",
            "3",
            "--schedule",
            "prior",
        ];
        let rest = [
            "--effort",
            "brief",
            "--data",
            "procedural:12",
            "--missing",
            "0.5",
        ];
        let arguments = [&train[..], &rest, &["--out", &name]].concat();
        succeed(directory, &arguments);

        let shown = succeed(directory, &["inspect", &name]);
        for part in [
            "(completed)",
            "3; any reading may be missing",
            "24 components, 64 hidden units",
            "missing readings 0.5, noise 0, procedural 0.15",
        ] {
            assert!(shown.contains(part), "{part} in {shown}");
        }

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
        assert!(source.contains("pub const READINGS: [i8; 792]"), "{source}");

        let evaluate = [
            "evaluate",
            "--recipe",
            &name,
            "--test",
            "procedural:3:77",
            "--json",
        ];
        let verdict: Value =
            serde_json::from_str(&succeed(directory, &evaluate)).expect("it is JSON");
        assert_eq!(verdict["method"], "completed");
        let loss = verdict["loss"].as_f64().expect("a loss");
        assert!((0.001..0.06).contains(&loss), "{model}: {loss}");
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
    for (arguments, expected) in [
        (
            &["--missing", "0.5"][..],
            "--missing has no effect: it is for --schedule prior",
        ),
        (
            &["--noise", "0.02"],
            "--noise has no effect: it is for --schedule prior",
        ),
        (
            &["--procedural", "0"],
            "--procedural has no effect: it is for --schedule prior",
        ),
        (
            &["--schedule", "prior", "--bases", "5"],
            "--bases has no effect with --schedule prior",
        ),
        (
            &["--schedule", "prior", "--missing", "1.5"],
            "--missing must be 0 to 1, not 1.5",
        ),
    ] {
        let message = fail(scratch.path(), &[&train[..], arguments].concat());
        assert!(message.contains(expected), "{message}");
    }
}
