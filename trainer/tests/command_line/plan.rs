//! `trainer plan`, and where `trainer inspect` says that the arms stand.

use std::fs;
use std::path::Path;

use glimpse_core::recipe::Recipe;
use glimpse_materials::Source;
use serde_json::Value;

use super::common::assert_names;
use super::linear::stated;
use super::{fail, fail_naming, succeed, succeed_as_json, trainer};

const NEURAL: &[u8] = include_bytes!("../../../core/examples/recipes/neural-n8.recipe");

/// A folder with Neural's eight samples in it.
fn folder() -> tempfile::TempDir {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    fs::write(scratch.path().join("n8.recipe"), NEURAL).expect("it is written");
    scratch
}

/// A recipe whose readings may be missing, for arms that get to 80 degrees and no nearer than 10.
fn masked() -> String {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/recipes/");
    format!("{folder}masked/neural-n16.recipe")
}

fn plan(directory: &Path, options: &[&str]) -> String {
    succeed(directory, &[&["plan", "n8.recipe"], options].concat())
}

fn plan_as_json(directory: &Path, options: &[&str]) -> Value {
    succeed_as_json(
        directory,
        &[&["plan", "n8.recipe", "--json"], options].concat(),
    )
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

#[test]
fn a_plan_is_quicker_than_the_naive_order_and_visits_every_sample() {
    let scratch = folder();
    let directory = scratch.path();
    let found = plan_as_json(directory, &["--out", "plan.csv", "--blank", "sheet.csv"]);
    assert_eq!(
        (&found["order"], &found["samples"]),
        (&"travel".into(), &8.into())
    );
    assert_eq!(found["is_best"], true);
    let [travel, total, naive, settling] = [
        "moving_seconds",
        "seconds",
        "naive_moving_seconds",
        "settling_seconds",
    ]
    .map(|name| number(&found[name]));
    assert!(travel < 0.5 * naive, "{travel} {naive}");
    assert!((total - travel - settling).abs() < 1e-9 && (settling - 4.0).abs() < 1e-9);
    let visits = found["visits"].as_array().expect("a list");
    assert!((number(&visits[7]["seconds"]) - total).abs() < 1e-9);

    // The same rows as CSV, which `query` reads: the directions are the pattern's, as a material sees.
    let csv = fs::read_to_string(directory.join("plan.csv")).expect("it is there");
    let mut lines = csv.lines();
    assert_eq!(
        lines.next(),
        Some("index,theta_i,phi_i,theta_o,phi_o,swapped,seconds")
    );
    let indices: Vec<usize> = lines
        .map(|line| {
            line.split(',')
                .next()
                .expect("a cell")
                .parse()
                .expect("a number")
        })
        .collect();
    let mut sorted = indices.clone();
    sorted.sort_unstable();
    assert_eq!(sorted, (0..8).collect::<Vec<_>>());
    let recipe = Recipe::parse(NEURAL).expect("it is a recipe");
    let pattern: Vec<_> = recipe.pattern().collect();
    let material = &Source("procedural:1:4".into()).load().expect("it loads")[0];
    let seen = succeed(
        directory,
        &["query", "procedural:1:4", "--angles", "plan.csv"],
    );
    for (row, index) in seen.lines().skip(1).zip(indices) {
        let values = row.split(',').skip(5);
        for (value, expected) in values.zip(material.brdf(pattern[index])) {
            let value: f32 = value.parse().expect("a number");
            assert!(
                (value - expected).abs() < 1e-3 * (1.0 + expected),
                "{row}: {expected}"
            );
        }
    }

    let sheet = fs::read_to_string(directory.join("sheet.csv")).expect("it is there");
    assert!(sheet.starts_with("index,theta_i,phi_i,theta_o,phi_o,r,g,b\n"));
    for (row, planned) in sheet.lines().zip(csv.lines()).skip(1) {
        let angles: Vec<&str> = planned.split(',').take(5).collect();
        assert_eq!(row, angles.join(",") + ",,,");
    }
    let text = plan(directory, &[]);
    assert_names(&text, &["28.8", "70.9"]);
}

#[test]
fn what_the_machine_is_like_counts() {
    let scratch = folder();
    let travel =
        |options: &[&str]| number(&plan_as_json(scratch.path(), options)["moving_seconds"]);
    let usual = travel(&[]);
    let twice = travel(&["--speed", "20"]);
    assert!((usual - 2.0 * twice).abs() < 1e-9);
    assert!(travel(&["--speed", "10,0,10,10"]) > usual);
    assert!(travel(&["--swap"]) <= usual);
    assert!(travel(&["--anisotropic"]) > usual);
    assert!(travel(&["--no-full-turns"]) >= usual);
    assert!(travel(&["--order", "progressive"]) > usual);
    assert!(travel(&["--start", "48.87,69.42,48.67,-110.10"]) < usual);
    let longer = plan_as_json(scratch.path(), &["--settle", "2"]);
    assert_eq!(number(&longer["settling_seconds"]), 16.0);
}

#[test]
fn what_is_out_of_reach_is_named_and_nothing_is_planned() {
    let scratch = folder();
    let directory = scratch.path();
    let within = [
        "plan",
        "n8.recipe",
        "--max-theta-o",
        "80",
        "--out",
        "plan.csv",
    ];
    let message = fail(directory, &within);
    let missed = [
        "2", "8", "6", "56.90", "1.86", "86.76", "-1.56", "7", "79.04", "6.756",
    ];
    assert_names(&message, &missed);
    assert_names(&message, &["max_theta_o", "--max-theta-i", "--swap"]);
    assert!(!directory.join("plan.csv").exists());
    succeed(directory, &[&within[..], &["--swap"]].concat());
    let csv = fs::read_to_string(directory.join("plan.csv")).expect("it is there");
    let swapped = |index: &str| {
        let own = csv.lines().find(|line| line.starts_with(index));
        own.is_some_and(|line| line.contains(",true,"))
    };
    assert!(swapped("6,") && swapped("7,"), "{csv}");

    // Limits that a recipe states hold unless others are given.
    let masked = masked();
    let found = succeed_as_json(directory, &["plan", &masked, "--swap", "--json"]);
    for (limit, degrees) in [
        ("max_theta_i", 80.0),
        ("max_theta_o", 80.0),
        ("min_separation", 10.0),
    ] {
        let stated = number(&found["machine"][limit]);
        assert!((stated - degrees).abs() < 1e-3, "{limit} {stated}");
    }
    fail(directory, &["plan", &masked, "--max-theta-i", "70"]);
    fs::write(directory.join("stated.recipe"), stated().bytes()).expect("it is written");
    fail_naming(directory, &["plan", "stated.recipe"], &["3", "in_plane"]);
}

#[test]
fn options_that_make_no_sense_are_refused_by_name() {
    let scratch = folder();
    for (options, named) in [
        (&["--speed", "fast"][..], &["--speed", "fast"][..]),
        (&["--speed", "1,2"], &["--speed", "1,2"]),
        (&["--speed", "1,2,3,inf"], &["--speed", "1,2,3,inf"]),
        (&["--speed", "0"], &["theta_i", "0"]),
        (&["--speed", "-5"], &["theta_i", "-5"]),
        (&["--speed", "10,0,10,0"], &["phi_i", "phi_o", "0"]),
        (&["--speed", "10,0,10,10", "--anisotropic"], &["phi_i", "0"]),
        (&["--settle", "-1"], &["-1"]),
        (&["--start", "0"], &["--start", "0"]),
        (&["--start", "-200,0,0,0"], &["theta_i", "-200"]),
        (
            &["--start", "0,0,0,200", "--no-full-turns"],
            &["200", "180"],
        ),
        (&["--max-theta-i", "95"], &["--max-theta-i", "90"]),
        (
            &[
                "--max-theta-i",
                "20",
                "--max-theta-o",
                "20",
                "--min-separation",
                "50",
            ],
            &[],
        ),
        (&["--force"], &["--force"]),
        (
            &["--out", "a.csv", "--blank", "./a.csv"],
            &["--out", "--blank"],
        ),
        (&["--out", "n8.recipe", "--force"], &["--out", "n8.recipe"]),
        (&["--blank", "n8.recipe"], &["--blank", "n8.recipe"]),
    ] {
        let arguments = [&["plan", "n8.recipe"], options].concat();
        fail_naming(scratch.path(), &arguments, named);
    }
    let names = fs::read_dir(scratch.path()).expect("it can be listed");
    assert_eq!(names.count(), 1, "something was written");
}

#[test]
fn a_sheet_that_was_filled_in_stays() {
    let scratch = folder();
    let directory = scratch.path();
    for option in ["--out", "--blank"] {
        plan(directory, &[option, "sheet.csv"]);
        plan(directory, &[option, "sheet.csv"]); // the same again
        let sheet = directory.join("sheet.csv");
        let filled = fs::read_to_string(&sheet).expect("it is there") + "more\n";
        fs::write(&sheet, &filled).expect("it is written");
        let again = ["plan", "n8.recipe", option, "sheet.csv"];
        fail_naming(directory, &again, &[option, "sheet.csv", "--force"]);
        assert_eq!(fs::read_to_string(&sheet).expect("it is there"), filled);
        plan(directory, &[option, "sheet.csv", "--force"]);
        assert_ne!(fs::read_to_string(&sheet).expect("it is there"), filled);
        fs::remove_file(&sheet).expect("it is removed");
    }
}

#[test]
fn the_recipe_s_own_order_is_kept_and_noted_to_be_in_vain_where_all_are_needed() {
    let scratch = folder();
    let masked = masked();
    for (recipe, samples, in_vain) in [("n8.recipe", 8, true), (&masked, 16, false)] {
        let arguments = ["plan", recipe, "--order", "progressive", "--swap", "--json"];
        let output = trainer(scratch.path(), &arguments);
        assert!(output.status.success(), "{output:?}");
        assert_eq!(!output.stderr.is_empty(), in_vain, "{output:?}");
        let found: Value = serde_json::from_slice(&output.stdout).expect("it is JSON");
        let visits = found["visits"].as_array().expect("a list");
        let indices = visits.iter().map(|visit| number(&visit["index"]) as usize);
        assert!(indices.eq(0..samples));
    }
}

#[test]
fn inspect_shows_where_the_arms_stand() {
    let scratch = folder();
    let directory = scratch.path();
    let shown = succeed(directory, &["inspect", "n8.recipe"]);
    assert_names(&shown, &["theta_i", "phi_i", "theta_o", "phi_o"]);
    let json = succeed(directory, &["inspect", "n8.recipe", "--json"]);
    succeed(
        directory,
        &[
            "export",
            "n8.recipe",
            "--format",
            "json",
            "--out",
            "n8.json",
        ],
    );
    assert_eq!(
        json,
        fs::read_to_string(directory.join("n8.json")).expect("it is there")
    );
    let found: Value = serde_json::from_str(&json).expect("it is JSON");
    let arms = found["arms"].as_array().expect("a list");
    assert_eq!(arms.len(), 8);
    for (row, line) in arms
        .iter()
        .zip(shown.lines().rev().take(8).collect::<Vec<_>>().iter().rev())
    {
        let cells: Vec<f64> = line
            .split_whitespace()
            .skip(4)
            .map(|cell| cell.parse().expect("a number"))
            .collect();
        assert_eq!(cells.len(), 4);
        for (cell, radians) in cells.iter().zip(row.as_array().expect("a row")) {
            assert!(
                (cell - number(radians).to_degrees()).abs() < 0.011,
                "{line} {row}"
            );
        }
    }
}

#[test]
fn times_have_the_names_of_the_contract() {
    let scratch = folder();
    let found = plan_as_json(scratch.path(), &[]);
    let [seconds, moving, settling] =
        ["seconds", "moving_seconds", "settling_seconds"].map(|name| number(&found[name]));
    assert!((seconds - moving - settling).abs() < 1e-9);
    let [naive, naive_moving] =
        ["naive_seconds", "naive_moving_seconds"].map(|name| number(&found[name]));
    assert!((naive - naive_moving - settling).abs() < 1e-9 && naive > seconds);
}
