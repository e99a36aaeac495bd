//! `trainer reproduce`

use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use super::{fail, succeed, trainer};

/// An experiment that trains Linear only.
const BASES: [&str; 8] = [
    "reproduce",
    "bases",
    "--data",
    "procedural:10",
    "--test",
    "procedural:3:1",
    "--seeds",
    "2",
];

fn modified(path: &Path) -> std::time::SystemTime {
    let metadata = fs::metadata(path).expect("it is there");
    metadata.modified().expect("files have times")
}

#[test]
fn an_experiment_is_printed_written_down_and_not_made_twice() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    let printed = succeed(directory, &BASES);
    for part in ["Linear with 5 components and with 240", "NJR15", "PSNR"] {
        assert!(printed.contains(part), "no {part} in {printed}");
    }
    let paper = directory.join("paper");
    let csv = fs::read_to_string(paper.join("bases/bases.csv")).expect("the table is there");
    // Random, NJR15 and Ours with two priors, for 5 components and for the 29 that there are.
    assert_eq!(csv.lines().count(), 1 + 8, "{csv}");
    assert!(
        csv.lines().skip(5).all(|line| line.starts_with("29,")),
        "{csv}"
    );
    let json = fs::read_to_string(paper.join("bases/findings.json")).expect("it is there");
    let json: Value = serde_json::from_str(&json).expect("it is JSON");
    let row = &json["tables"]["bases"]["rows"][2];
    assert_eq!(row["Method"], "Ours (joint)");
    let settings = &json["tables"]["bases"]["settings"];
    let training = json!([{"schedule": "joint", "effort": "quick"}]);
    assert_eq!(settings["trainings"], training);
    let set = |source: &str, materials: usize| json!({"source": source, "materials": materials});
    assert_eq!(settings["training_set"], set("procedural:10", 10));
    assert_eq!(settings["test_set"], set("procedural:3:1", 3));
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
    assert!(html.contains("<h2>Linear with 5 components and with 240</h2>"));

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
    let output = trainer(directory, &BASES);
    let talk = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{talk}");
    assert!(!talk.contains("training linear"), "{talk}");
    assert_eq!(talk.matches("judging ").count(), 2, "{talk}");
    assert_eq!(String::from_utf8_lossy(&output.stdout), printed);
    assert_eq!(modified(&recipe), before);
    assert_eq!(read(), judged);
}

#[test]
fn work_of_other_settings_is_not_mixed_in() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    fs::create_dir_all(directory.join("paper")).expect("it is made");
    fs::write(directory.join("paper/settings.json"), "another seed").expect("it is written");
    let message = fail(directory, &BASES);
    for part in ["paper", "--out", "settings.json"] {
        assert!(message.contains(part), "no {part} in {message}");
    }
}

#[test]
fn what_is_judged_must_not_be_trained_on_and_additional_sources_must_be_given() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let mut same = BASES.to_vec();
    same[5] = "procedural:3";
    let message = fail(scratch.path(), &same);
    assert!(message.contains("must not be trained on"), "{message}");
    let mut additional = BASES.to_vec();
    additional[1] = "additional";
    let message = fail(scratch.path(), &additional);
    assert!(message.contains("--additional"), "{message}");
}
