//! `trainer reproduce`

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use serde_json::Value;

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
    assert_eq!(row["Method"], "Ours");
    assert!(
        row["Loss"]
            .as_f64()
            .is_some_and(|loss| loss > 0.0 && loss < 1.0),
        "{row}"
    );
    let html = fs::read_to_string(paper.join("index.html")).expect("the page is there");
    assert_eq!(html.matches("<h2>").count(), 1, "{html}");

    // The same command again trains and judges nothing; a lost sheet is made again, the same.
    let recipe = paper.join("recipes/linear-n8-m5-eta-40.recipe");
    let sheet = paper.join("sheets/test/linear-n8-m5-eta-40-ours.json");
    let (before, judged) = (modified(&recipe), fs::read(&sheet).expect("it is there"));
    fs::remove_file(&sheet).expect("it is removed");
    let sheets = || {
        let sheets = fs::read_dir(paper.join("sheets/test")).expect("it can be listed");
        let sheets = sheets.map(|sheet| sheet.expect("an entry").path());
        sheets
            .map(|sheet| (modified(&sheet), sheet))
            .collect::<BTreeSet<_>>()
    };
    let others = sheets();
    assert_eq!(succeed(directory, &BASES), printed);
    assert_eq!(modified(&recipe), before);
    assert!(sheets().is_superset(&others) && sheets().len() == others.len() + 1);
    assert_eq!(fs::read(&sheet).expect("it is there"), judged);
}

#[test]
fn work_of_other_settings_is_not_mixed_in() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    fs::create_dir_all(directory.join("paper")).expect("it is made");
    fs::write(directory.join("paper/settings.txt"), "another seed").expect("it is written");
    fail_naming(directory, &BASES, &["paper", "--out", "settings.txt"]);
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
