//! `trainer reproduce`

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use super::shared::{BASES, EXPERIMENT};
use super::{fail_naming, succeed};

fn modified(path: &Path) -> std::time::SystemTime {
    let metadata = fs::metadata(path).expect("it is there");
    metadata.modified().expect("files have times")
}

#[test]
fn an_experiment_is_printed_written_down_and_not_made_twice() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    let printed = EXPERIMENT.copy_to(directory);
    let paper = directory.join("paper");
    let csv = fs::read_to_string(paper.join("bases/bases.csv")).expect("the table is there");
    // Random, NJR15 and Ours with two priors, for 5 components and for the 11 that there are.
    assert_eq!(csv.lines().count(), 1 + 8, "{csv}");
    assert!(
        csv.lines().skip(5).all(|line| line.starts_with("11,")),
        "{csv}"
    );
    let json = fs::read_to_string(paper.join("bases/findings.json")).expect("it is there");
    let json: Value = serde_json::from_str(&json).expect("it is JSON");
    let row = &json["tables"]["bases"]["rows"][2];
    assert_eq!(row["Method"], "Ours (joint)");
    let settings = &json["tables"]["bases"]["settings"];
    let training = json!([{"schedule": "joint", "effort": "brief"}]);
    assert_eq!(settings["trainings"], training);
    let set = |source: &str, materials: usize| json!({"source": source, "materials": materials});
    assert_eq!(settings["training_set"], set("procedural:4", 4));
    assert_eq!(settings["test_set"], set("procedural:1:1", 1));
    assert_eq!(
        (&settings["seed"], &settings["seeds_of_random_methods"]),
        (&json!(0), &json!(2))
    );
    assert!(
        row["Loss"]
            .as_f64()
            .is_some_and(|loss| loss > 0.0 && loss < 1.0),
        "{row}"
    );
    let html = fs::read_to_string(paper.join("index.html")).expect("the page is there");
    assert_eq!(html.matches("<h2>").count(), 1, "{html}");

    // The same command again trains and evaluates nothing; a lost sheet, and one that an older version
    // wrote, which lacks a metric, are made again, the same.
    let recipe = paper.join("recipes/linear-n8-m5-eta-40-joint.recipe");
    let sheets = ["joint-ours", "njr15"]
        .map(|method| paper.join(format!("sheets/test/linear-n8-m5-eta-40-{method}.json")));
    let before = modified(&recipe);
    let read = || {
        sheets
            .each_ref()
            .map(|sheet| fs::read(sheet).expect("it is there"))
    };
    let judged = read();
    fs::remove_file(&sheets[0]).expect("it is removed");
    let mut older: Value = serde_json::from_slice(&judged[1]).expect("it is JSON");
    let lacking = older.as_object_mut().expect("an object").remove("delta_e");
    assert!(lacking.is_some_and(|value| value.as_f64() > Some(0.0)));
    fs::write(&sheets[1], older.to_string()).expect("it is written");
    let modified_sheets = || {
        let sheets = fs::read_dir(paper.join("sheets/test")).expect("it can be listed");
        let sheets = sheets.map(|sheet| sheet.expect("an entry").path());
        sheets
            .map(|sheet| (modified(&sheet), sheet))
            .collect::<BTreeSet<_>>()
    };
    let others: BTreeSet<_> = modified_sheets()
        .into_iter()
        .filter(|(_, sheet)| !sheets.contains(sheet))
        .collect();
    assert_eq!(succeed(directory, &BASES), printed);
    assert_eq!(modified(&recipe), before);
    assert!(modified_sheets().is_superset(&others));
    assert_eq!(modified_sheets().len(), others.len() + sheets.len());
    assert_eq!(read(), judged);
}

#[test]
fn work_of_other_settings_is_not_mixed_in() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    fs::create_dir_all(directory.join("paper")).expect("it is made");
    fs::write(directory.join("paper/settings.json"), "another seed").expect("it is written");
    fail_naming(directory, &BASES, &["paper", "--out", "settings.json"]);
}

#[test]
fn what_is_judged_must_not_be_trained_on_and_additional_sources_must_be_given() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let mut same = BASES.to_vec();
    same[5] = "procedural:3";
    fail_naming(scratch.path(), &same, &["--data", "--test"]);
    let mut additional = BASES.to_vec();
    additional[1] = "additional";
    fail_naming(scratch.path(), &additional, &["--additional"]);
}
