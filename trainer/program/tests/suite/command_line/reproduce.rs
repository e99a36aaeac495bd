//! `trainer reproduce`

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use glimpse_evaluation::evaluation::names;

use super::shared::{BASES, EXPERIMENT};
use super::{Folder, number};
use crate::common::assert_names;

fn modified(path: &Path) -> std::time::SystemTime {
    let metadata = fs::metadata(path).expect("the file exists");
    metadata.modified().expect("a modification time")
}

#[test]
fn frontier_has_seconds_of_every_training() {
    let folder = Folder::new();
    folder.succeed(
        "reproduce frontier --effort brief --most-samples 2 --data procedural:12:3 --test procedural:1:9 --out paper",
    );
    let json = folder.read_json("paper/frontier/findings.json");
    let rows = json["tables"]["points"]["rows"].as_array().expect("a list");
    // Two methods for samples, three budgets, and chosen directions, each with n = 1 and 2.
    assert_eq!(rows.len(), 12);
    for row in rows {
        let motion = number(&row["seconds"]) - 0.5 * number(&row["n"]);
        assert!(motion > 0.0, "{row}");
        if row["Trained"]
            .as_str()
            .is_some_and(|name| name.contains(" 5 s"))
        {
            assert!(motion <= 5.0, "{row}");
        }
    }
    for plot in ["loss", "delta-e"] {
        assert!(
            folder.exists(&format!("paper/frontier/{plot}.svg")),
            "{plot}"
        );
    }
}

#[test]
fn experiment_is_saved_and_reused() {
    let folder = Folder::new();
    let printed = EXPERIMENT.copy_to(folder.path());
    let csv = folder.read_text("paper/bases/bases.csv");
    // Random, NJR15 and the paper's, for 5 components and for all 11.
    assert_eq!(csv.lines().count(), 1 + 6, "{csv}");
    let mut rows_of_all = csv.lines().skip(4);
    assert!(rows_of_all.all(|line| line.starts_with("11,")), "{csv}");
    let json = folder.read_json("paper/bases/findings.json");
    let row = &json["tables"]["bases"]["rows"][2];
    assert_eq!(row["Method"], names::PAPER);
    let loss = row["Loss"].as_f64();
    assert!(loss.is_some_and(|loss| loss > 0.0 && loss < 1.0), "{row}");
    let caption = json["tables"]["bases"]["caption"].as_str();
    let settings = "Schedule paper at effort brief (";
    let sets = "seed 0, 1 seeds of random directions. Training set: procedural:4 (4 materials). Test set: \
                procedural:1:1 (1 materials).";
    assert_names(caption.expect("a caption"), &[settings, sets]);
    let html = folder.read_text("paper/bases/index.html");
    assert_eq!(html.matches("<table>").count(), 1, "{html}");

    // The repeated command trains nothing, and evaluates only what is missing. The results are the same as before.
    let recipe = folder.at("paper/recipes/linear-n8-m5-paper.recipe");
    let sheet = "paper/sheets/test/linear-n8-m5-paper.json";
    let before = modified(&recipe);
    let evaluation = folder.read(sheet);
    fs::remove_file(folder.at(sheet)).expect("the file is removed");
    let modified_sheets = || -> BTreeSet<_> {
        let names = folder.names("paper/sheets/test").into_iter();
        let sheets = names.map(|name| format!("paper/sheets/test/{name}"));
        sheets
            .map(|sheet| (modified(&folder.at(&sheet)), sheet))
            .collect()
    };
    let others = modified_sheets();
    assert_eq!(folder.succeed(BASES), printed);
    assert_eq!(modified(&recipe), before);
    assert!(modified_sheets().is_superset(&others));
    assert_eq!(folder.read(sheet), evaluation);

    // A damaged evaluation is an error that names its file.
    folder.write(sheet, "{}");
    folder.fail_naming(BASES, &[sheet]);
}

#[test]
fn rejects_folder_of_other_settings() {
    let folder = Folder::new();
    fs::create_dir_all(folder.at("paper")).expect("the folder is created");
    folder.write("paper/settings.json", "another seed");
    folder.fail_naming(BASES, &["paper", "--out", "settings.json"]);
}

#[test]
fn rejects_overlapping_and_missing_materials() {
    let folder = Folder::new();
    let same = BASES.replace("procedural:1:1", "procedural:3");
    folder.fail_naming(&same, &["--data", "--test"]);
    let additional = BASES.replace("bases", "additional");
    folder.fail_naming(&additional, &["--additional"]);
}
