//! `--list`: the commands of cells.

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::Value;

use super::Folder;
use super::shared::{BASES, EXPERIMENT, files_below};

/// The cells that a command prints.
fn cells(folder: &Folder, command: &str) -> Vec<Value> {
    let printed = folder.succeed(&format!("{command} --list"));
    let lines = printed.lines().map(serde_json::from_str);
    lines.collect::<Result<_, _>>().expect("lines of JSON")
}

fn name(cell: &Value) -> &str {
    cell["name"].as_str().expect("text")
}

fn texts(cell: &Value, field: &str) -> Vec<String> {
    let list = cell[field].as_array().expect("a list").iter();
    list.map(|text| text.as_str().expect("text").to_owned())
        .collect()
}

/// A cell's command, as one line.
fn command(cell: &Value) -> String {
    let words = texts(cell, "command");
    assert_eq!(words[0], "trainer");
    let words = words[1..].iter().map(String::as_str);
    shlex::try_join(words).expect("words without NUL")
}

/// Runs a cell's command.
fn run(folder: &Folder, cell: &Value) {
    let output = folder.run(&command(cell));
    let messages = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{cell}: {messages}");
    for path in texts(cell, "outputs") {
        assert!(folder.exists(&path), "{cell} did not write {path}");
    }
}

/// Asserts that the inputs of each cell are outputs of cells before it.
fn assert_inputs_come_first(cells: &[Value]) {
    let mut written: Vec<String> = Vec::new();
    for cell in cells {
        for input in texts(cell, "inputs") {
            assert!(
                written.contains(&input),
                "no cell before {cell} writes {input}"
            );
        }
        written.extend(texts(cell, "outputs"));
    }
}

/// Asserts that all cells are done, or that none is.
fn assert_done(cells: &[Value], done: bool) {
    assert!(cells.iter().all(|cell| cell["done"] == done), "{cells:?}");
}

/// The contents of all files below a folder that have one of these suffixes.
fn files(folder: &Path, suffixes: &[&str]) -> BTreeMap<String, Vec<u8>> {
    let files = files_below(folder).into_iter();
    let named = files.map(|(path, bytes)| (path.to_string_lossy().into_owned(), bytes));
    named
        .filter(|(name, _)| suffixes.iter().any(|suffix| name.ends_with(suffix)))
        .collect()
}

#[test]
fn cells_write_same_recipes_as_grid() {
    let folder = Folder::new();
    let grid = |samples, seed, out| {
        format!(
            "train --grid --model phong,linear --data procedural:4 --data procedural:3:1 --share 3,1 \
             --missing 0.25 --effort brief --seed {seed} -n {samples} --out {out}"
        )
    };
    let listed = cells(&folder, &grid("1,2", 5, "many"));
    let names: Vec<&str> = listed.iter().map(name).collect();
    assert_eq!(names, ["phong-n1", "phong-n2", "linear-n1", "linear-n2"]);

    folder.succeed(&grid("2", 5, "whole"));
    let command = grid("2", 5, "\"it's here\"");
    let listed = cells(&folder, &command);
    assert_done(&listed, false);
    for cell in &listed {
        assert!(texts(cell, "inputs").is_empty(), "{cell}");
        run(&folder, cell);
    }
    let files = |name| files(&folder.at(name), &[".recipe", ".basis"]);
    let whole = files("whole");
    assert_eq!(whole.len(), 3);
    assert_eq!(files("it's here"), whole);

    assert_done(&cells(&folder, &command), true);
    folder.succeed(&command);
    assert_eq!(files("it's here"), whole);

    // The recipes of another seed conflict: a cell's command would refuse to replace them.
    let listed = cells(&folder, &grid("2", 6, "\"it's here\""));
    assert_done(&listed, false);
    for cell in listed {
        assert!(cell["in_the_way"].is_string(), "{cell}");
    }
}

#[test]
fn linear_options_only_in_linear_cells() {
    let grid = "train --grid --model phong,linear -n 2 --data procedural:4 --schedule paper --bases 3 \
                --effort brief --out grid";
    let listed = cells(&Folder::new(), grid);
    let has = |cell: &Value| texts(cell, "command").contains(&"--bases=3".to_owned());
    assert_eq!(listed.iter().map(has).collect::<Vec<_>>(), [false, true]);
}

#[test]
fn cells_write_same_files_as_experiment() {
    let folder = Folder::new();
    let whole = folder.at("whole");
    let printed = EXPERIMENT.copy_to(&whole);
    let listed = cells(&folder, BASES);
    assert!(!folder.exists("paper/settings.json"));
    assert_done(&listed, false);
    assert_inputs_come_first(&listed);
    // The command of an evaluation fails if its recipe is missing.
    let is_evaluation = |cell: &&Value| name(cell) == "sheets/test/linear-n8-m5-paper-ours";
    let evaluation = listed.iter().find(is_evaluation);
    let evaluation = evaluation.expect("an evaluation of Ours");
    let inputs = texts(evaluation, "inputs");
    assert_eq!(inputs.len(), 2, "a recipe and its basis: {evaluation}");
    folder.fail_naming(&command(evaluation), &[&inputs[0]]);

    for cell in &listed {
        run(&folder, cell);
    }
    let written = |root: &Path| files(&root.join("paper"), &[".recipe", ".basis", "json"]);
    let (mut whole, mut paper) = (written(&whole), written(folder.path()));
    // The command without --list writes the tables.
    whole.retain(|name, _| name.starts_with("recipes/") || name.starts_with("sheets/"));
    paper.retain(|name, _| name != "settings.json");
    assert!(paper.keys().eq(whole.keys()), "{:?}", paper.keys());
    assert!(paper == whole, "some bytes differ");
    let outputs = listed.iter().map(|cell| texts(cell, "outputs").len());
    assert_eq!(paper.len(), outputs.sum::<usize>());

    // All cells are done; the command prints the tables.
    assert_done(&cells(&folder, BASES), true);
    assert_eq!(folder.succeed(BASES), printed);
    let now = written(folder.path());
    let is_unchanged = |(name, bytes)| now.get(name) == Some(bytes);
    assert!(paper.iter().all(is_unchanged));
}

#[test]
fn lists_all_experiments_without_writing() {
    let folder = Folder::new();
    let all =
        "reproduce all --data procedural:3 --test procedural:2:1 --effort brief --most-samples 8";
    let listed = cells(&folder, all);
    assert_inputs_come_first(&listed);
    for expected in [
        "recipes/neural-n8-paper-pattern-glossy",
        "recipes/phong-n8-paper-seed4",
        "recipes/cook-torrance-n8-paper",
        "recipes/cook-torrance-n8-prior",
        "recipes/linear-n8-m5-paper",
        "recipes/linear-n8-prior",
        "recipes/phong-n8-paper-twice",
        "recipes/linear-n4-prior-within-20s",
        "sheets/test/phong-n8-paper-ours-replaced4-run2",
        "sheets/test/neural-n4-paper-meta-importance",
        "sheets/test/neural-n512-random-refined",
        "sheets/test/linear-m5-optimum",
    ] {
        let mut names = listed.iter().map(name);
        assert!(names.any(|name| name == expected), "no {expected}");
    }
    assert!(folder.names("paper").is_empty(), "a file was written");
}

#[test]
fn rejects_options_that_exclude_list() {
    let folder = Folder::new();
    let bases = "reproduce bases --data procedural:3 --out paper";
    folder.fail_naming(
        "train --model phong -n 2 --out a.recipe --list",
        &["--grid"],
    );
    folder.fail_each(
        bases,
        &[
            "--list --table bases => --table",
            "--list --only recipes/a => --only",
            "--only a --table bases => --table",
            "--only recipes/none => recipes/none --list",
        ],
    );
}
