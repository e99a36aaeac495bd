//! `trainer reproduce`

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use super::Folder;
use super::shared::{BASES, EXPERIMENT};
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
    let column = |name| folder.column("paper/frontier/evaluations.csv", name);
    let [all_n, variations, all_seconds] = ["n", "Variation", "seconds"].map(column);
    // Two methods for samples, three budgets, and chosen directions, each with n = 1 and 2.
    assert_eq!(all_n.len(), 12);
    for ((n, seconds), variation) in all_n.iter().zip(&all_seconds).zip(variations) {
        let [n, seconds] = [n, seconds].map(|cell| cell.parse::<f64>().expect("a number"));
        let motion = seconds - 0.5 * n;
        assert!(motion > 0.0, "{variation} {n} {seconds}");
        let is_short = motion <= 5.0 || !variation.starts_with("5 s");
        assert!(is_short, "{variation} {n} {seconds}");
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
    // The long table has the paper's three values, too.
    let evaluations = folder.read_text("paper/bases/evaluations.csv");
    let published = evaluations
        .lines()
        .filter(|line| line.starts_with("published,"));
    assert_eq!(evaluations.lines().count() - published.count(), 1 + 6);
    assert_names(printed, &["brief", "procedural:4", "procedural:1:1"]);
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
fn rejects_changed_material_of_the_same_name() {
    let folder = Folder::new();
    fs::create_dir(folder.at("test")).expect("the folder is created");
    let bases = BASES.replace("procedural:1:1", "test");
    folder.succeed("convert procedural:1:3 test/gold.binary");
    folder.succeed(&bases);
    folder.succeed("convert procedural:1:4 test/gold.binary --force");
    folder.fail_naming(&bases, &["materials.json", "--out"]);
}

#[test]
fn rejects_folder_of_other_settings_and_overlapping_or_missing_materials() {
    let folder = Folder::new();
    let same = BASES.replace("procedural:1:1", "procedural:3");
    folder.fail_naming(&same, &["--data", "--test"]);
    let additional = BASES.replace("bases", "additional");
    folder.fail_naming(&additional, &["--additional"]);
    fs::create_dir_all(folder.at("paper")).expect("the folder is created");
    folder.write("paper/settings.json", "another seed");
    folder.fail_naming(BASES, &["paper", "--out", "settings.json"]);
}
