//! Commands in documents are valid: the trainer's commands with all options, and cargo's examples.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

use super::figures::printed;
use super::{documents, root, with_figures};

/// Returns the words of a command, or of the first one in a list with `&&`, `|` or `;`. Quotes and redirections
/// (`> FILE`, `>&2`) are removed.
fn words(command: &str) -> Vec<String> {
    let command = command.split(" #").next().unwrap_or_default();
    let words = command.split_whitespace();
    let mut words = words.take_while(|word| !["&&", "|", ";"].contains(word));
    let mut own = Vec::new();
    while let Some(word) = words.next() {
        match word {
            ">" | ">>" => drop(words.next()),
            _ if word.starts_with('>') => {}
            _ => own.push(word.replace('"', "")),
        }
    }
    own
}

/// Returns the error of an invalid command; None if it is valid.
fn command_error(command: &str) -> Option<String> {
    let words = words(command);
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match words[..] {
        ["trainer", ref arguments @ ..] => trainer(arguments),
        ["cargo", "run", ref arguments @ ..] => cargo(arguments, "example"),
        ["cargo", "test", ref arguments @ ..] => cargo(arguments, "test"),
        _ => Some("neither a trainer nor a cargo command".into()),
    }
}

/// Returns the error of a trainer command. With `--help` at the end, it parses all options but does not run.
fn trainer(arguments: &[&str]) -> Option<String> {
    let output = Command::new(env!("CARGO_BIN_EXE_trainer"))
        .args(arguments)
        .arg("--help")
        .output()
        .expect("the trainer runs");
    let messages = String::from_utf8_lossy(&output.stderr).into_owned();
    (!output.status.success()).then_some(messages)
}

/// Returns an error if the package of a cargo command lacks the example or test, or the features.
fn cargo(arguments: &[&str], kind: &str) -> Option<String> {
    let own = arguments.split(|word| *word == "--");
    let own = own.into_iter().next().unwrap_or_default();
    let after = |option: &str| {
        let place = own.iter().position(|word| *word == option)?;
        own.get(place + 1).copied()
    };
    let manifest = after("--manifest-path").unwrap_or("Cargo.toml");
    let package_name = after("-p");
    let Some(target_name) = after(&format!("--{kind}")) else {
        return Some(format!("no {kind}"));
    };
    let exists = packages(&root().join(manifest)).into_iter().any(|package| {
        let has_name = package_name.is_none_or(|name| package["name"] == name);
        let has_target = package["targets"]
            .as_array()
            .into_iter()
            .flatten()
            .any(|target| target["name"] == target_name && target["kind"][0] == kind);
        let has_feature =
            after("--features").is_none_or(|name| package["features"][name].is_array());
        has_name && has_target && has_feature
    });
    (!exists).then(|| format!("cargo has no such {kind}: {target_name}"))
}

fn packages(manifest: &Path) -> Vec<Value> {
    let output = Command::new(env!("CARGO"))
        .args([
            "metadata",
            "--no-deps",
            "--offline",
            "--format-version",
            "1",
            "--manifest-path",
        ])
        .arg(manifest)
        .output()
        .expect("cargo runs");
    let metadata: Value = serde_json::from_slice(&output.stdout).expect("JSON from cargo");
    metadata["packages"].as_array().expect("a list").clone()
}

#[test]
fn commands_of_markers_are_valid() {
    for document in with_figures() {
        for printed in printed(&document) {
            let error = command_error(printed.command);
            let path = document.path.display();
            assert_eq!(error, None, "{path}: {}", printed.command);
        }
    }
}

#[test]
fn commands_in_shell_blocks_are_valid() {
    let mut count = 0;
    for document in documents() {
        let shown = document.text.split("```").skip(1).step_by(2);
        for block in shown.filter(|block| block.starts_with("sh\n")) {
            let joined = block.replace("\\\n", " ");
            for line in joined.lines() {
                let own = line.split("--bin trainer -- ").last().unwrap_or(line);
                if !own.starts_with("trainer ") && own.len() == line.len() {
                    continue;
                }
                count += 1;
                let arguments = words(own.strip_prefix("trainer ").unwrap_or(own));
                let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
                let error = trainer(&arguments);
                assert_eq!(error, None, "{}: {line}", document.path.display());
            }
        }
    }
    assert!(count > 10, "only {count} commands were found");
}
