//! `--list`: cells as commands of their own.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde_json::Value;

use super::common::assert_names;
use super::shared::{BASES, EXPERIMENT};
use super::{fail, succeed, trainer};

/// Cells that a command prints.
fn cells(directory: &Path, command: &[&str]) -> Vec<Value> {
    let printed = succeed(directory, &[command, &["--list"]].concat());
    let lines = printed.lines().map(serde_json::from_str);
    lines.collect::<Result<_, _>>().expect("lines of JSON")
}

fn texts(cell: &Value, field: &str) -> Vec<String> {
    let list = cell[field].as_array().expect("a list").iter();
    list.map(|text| text.as_str().expect("text").to_owned())
        .collect()
}

/// Does what a cell's command says; `by_shell` as a shell reads it.
fn run(directory: &Path, cell: &Value, by_shell: bool) {
    let output = if by_shell {
        let line = cell["shell"].as_str().expect("text");
        let rest = line.strip_prefix("trainer ").expect("a command of ours");
        std::process::Command::new("sh")
            .args(["-c", &format!("\"$TRAINER\" {rest}")])
            .env("TRAINER", env!("CARGO_BIN_EXE_trainer"))
            .current_dir(directory)
            .output()
            .expect("it runs")
    } else {
        let words = texts(cell, "command");
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        assert_eq!(words[0], "trainer");
        trainer(directory, &words[1..])
    };
    let talk = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{cell}: {talk}");
    for path in texts(cell, "outputs") {
        assert!(directory.join(&path).exists(), "{cell} has left no {path}");
    }
}

/// The bytes of all files of these endings in a folder and below.
fn files(folder: &Path, endings: &[&str]) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).expect("it can be listed") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().expect("a name").to_string_lossy();
        if path.is_dir() {
            let below = files(&path, endings).into_iter();
            found.extend(below.map(|(below, bytes)| (format!("{name}/{below}"), bytes)));
        } else if endings.iter().any(|ending| name.ends_with(ending)) {
            found.insert(name.into_owned(), fs::read(&path).expect("it is there"));
        }
    }
    found
}

#[test]
fn a_grid_s_cells_leave_what_the_grid_does() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    let grid = |samples, out| {
        let words = "train --grid --model phong,linear --data procedural:4 --data procedural:3:1 \
                     --share 3,1 --missing 0.25 --effort brief --seed 5 --out";
        let mut words: Vec<&str> = words.split_whitespace().collect();
        words.extend([out, "-n", samples]);
        words
    };
    let listed = cells(directory, &grid("1,2", "many"));
    let names: Vec<&str> = listed
        .iter()
        .filter_map(|cell| cell["name"].as_str())
        .collect();
    assert_eq!(names, ["phong-n1", "phong-n2", "linear-n1", "linear-n2"]);

    succeed(directory, &grid("2", "whole"));
    let command = grid("2", "it's here");
    let listed = cells(directory, &command);
    for (index, cell) in listed.iter().enumerate() {
        assert_eq!(cell["done"], false, "{cell}");
        assert!(texts(cell, "inputs").is_empty(), "{cell}");
        run(directory, cell, index % 2 == 0);
    }
    let endings = [".recipe", ".basis"];
    let whole = files(&directory.join("whole"), &endings);
    assert_eq!(whole.len(), 3);
    assert_eq!(files(&directory.join("it's here"), &endings), whole);

    let listed = cells(directory, &command);
    assert!(listed.iter().all(|cell| cell["done"] == true), "{listed:?}");
    let grid_again = trainer(directory, &command);
    assert!(grid_again.status.success(), "{grid_again:?}");
    assert_eq!(files(&directory.join("it's here"), &endings), whole);

    // Recipes of another seed are in the way, and a cell's command would refuse to replace them.
    let mut other = command.clone();
    let seed = other.iter().position(|word| *word == "5").expect("a seed");
    other[seed] = "6";
    for cell in cells(directory, &other) {
        assert_eq!(cell["done"], false);
        assert!(cell["in_the_way"].is_string(), "{cell}");
    }
}

#[test]
fn an_option_for_linear_alone_is_given_to_linear_alone() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let words = "train --grid --model phong,linear -n 2 --data procedural:4 --schedule joint --bases 3 \
                 --effort brief --out grid";
    let command: Vec<&str> = words.split_whitespace().collect();
    let listed = cells(scratch.path(), &command);
    let has = |cell: &Value| texts(cell, "command").contains(&"--bases=3".to_owned());
    assert_eq!(listed.iter().map(has).collect::<Vec<_>>(), [false, true]);
}

#[test]
fn an_experiment_s_cells_leave_what_it_does() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    let whole = directory.join("whole");
    let printed = EXPERIMENT.copy_to(&whole);
    let listed = cells(directory, &BASES);
    assert!(!directory.join("paper/settings.json").exists());
    // What needs a recipe says so, and comes after it.
    for (index, cell) in listed.iter().enumerate() {
        assert_eq!(cell["done"], false, "{cell}");
        for input in texts(cell, "inputs") {
            let mut before = listed[..index].iter();
            assert!(
                before.any(|other| texts(other, "outputs").contains(&input)),
                "{input} of {cell} is made by none before it"
            );
        }
    }
    let judged = listed
        .iter()
        .position(|cell| cell["name"] == "sheets/test/linear-n8-m5-eta-40-joint-ours");
    let judged = &listed[judged.expect("Ours is judged")];
    assert_eq!(
        texts(judged, "inputs").len(),
        2,
        "a recipe and its basis: {judged}"
    );
    let words = texts(judged, "command");
    let words: Vec<&str> = words.iter().skip(1).map(String::as_str).collect();
    let inputs = texts(judged, "inputs");
    let recipe = inputs.iter().find(|input| input.ends_with(".recipe"));
    assert_names(
        &fail(directory, &words),
        &[recipe.expect("a recipe is needed")],
    );

    for cell in &listed {
        run(directory, cell, false);
    }
    let kept = |root: &Path| files(&root.join("paper"), &[".recipe", ".basis", "json"]);
    let (mut whole, mut paper) = (kept(&whole), kept(directory));
    // The tables are made by the command itself.
    whole.retain(|name, _| name.starts_with("recipes/") || name.starts_with("sheets/"));
    paper.retain(|name, _| name != "settings.json");
    assert_eq!(
        paper.keys().collect::<Vec<_>>(),
        whole.keys().collect::<Vec<_>>()
    );
    assert!(paper == whole, "some bytes differ");
    assert_eq!(
        paper.len(),
        listed
            .iter()
            .map(|cell| texts(cell, "outputs").len())
            .sum::<usize>()
    );

    // Nothing is left to train or to judge; the command prints the tables.
    let again = cells(directory, &BASES);
    assert!(again.iter().all(|cell| cell["done"] == true), "{again:?}");
    assert_eq!(succeed(directory, &BASES), printed);
    assert!(kept(directory).iter().all(|(name, bytes)| {
        let made = paper.get(name);
        made.is_none_or(|made| made == bytes)
    }));
}

#[test]
fn all_experiments_are_listed_without_making_anything() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let words =
        "reproduce all --data procedural:3 --test procedural:2:1 --effort brief --most-samples 8";
    let command: Vec<&str> = words.split_whitespace().collect();
    let listed = cells(scratch.path(), &command);
    let mut made: Vec<String> = Vec::new();
    for cell in &listed {
        for input in texts(cell, "inputs") {
            assert!(
                made.contains(&input),
                "{input} is made by no cell before {cell}"
            );
        }
        made.extend(texts(cell, "outputs"));
    }
    for name in [
        "recipes/neural-n8-joint-meta",
        "recipes/neural-n8-joint-pattern-glossy",
        "sheets/test/phong-n8-replaced4-run2",
        "sheets/test/neural-n4-importance",
        "recipes/phong-n8-paper",
        "recipes/phong-n8-paper-twice",
        "recipes/neural-n8-prior",
    ] {
        assert!(listed.iter().any(|cell| cell["name"] == name), "no {name}");
    }
    let names = fs::read_dir(scratch.path().join("paper")).expect("the folder is there");
    assert_eq!(names.count(), 0, "something was written");
}

#[test]
fn losses_need_a_recipe_of_each_model_by_each_schedule() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let words = "reproduce losses --paper-effort long --data procedural:3 --test procedural:2:1";
    let command: Vec<&str> = words.split_whitespace().collect();
    let listed = cells(scratch.path(), &command);
    let names = listed.iter().filter_map(|cell| cell["name"].as_str());
    let mut recipes: Vec<&str> = names
        .filter_map(|name| name.strip_prefix("recipes/"))
        .collect();
    recipes.sort_unstable();
    let expected = [
        "cook-torrance-n8-joint",
        "cook-torrance-n8-paper",
        "cook-torrance-n8-prior",
        "linear-n8-m5-eta-40-paper",
        "linear-n8-m60-eta-learned-joint",
        "linear-n8-prior",
        "neural-n8-joint",
        "neural-n8-paper",
        "neural-n8-prior",
        "phong-n8-joint",
        "phong-n8-paper",
        "phong-n8-prior",
    ];
    assert_eq!(recipes, expected);
}

#[test]
fn what_has_no_effect_beside_a_list_is_refused() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let train = [
        "train", "--model", "phong", "-n", "2", "--out", "a.recipe", "--list",
    ];
    let bases = [
        "reproduce",
        "bases",
        "--data",
        "procedural:3",
        "--out",
        "paper",
    ];
    for (command, word) in [
        (&train[..], "--grid"),
        (
            &[&bases[..], &["--list", "--table", "bases"]].concat(),
            "--table",
        ),
        (
            &[&bases[..], &["--list", "--only", "recipes/a"]].concat(),
            "--only",
        ),
        (
            &[&bases[..], &["--only", "a", "--table", "bases"]].concat(),
            "--table",
        ),
    ] {
        assert_names(&fail(scratch.path(), command), &[word]);
    }
    let message = fail(
        scratch.path(),
        &[&bases[..], &["--only", "recipes/none"]].concat(),
    );
    assert_names(&message, &["recipes/none", "--list"]);
}
