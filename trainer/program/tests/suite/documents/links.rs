//! Links between documents, and from them to files.

use std::fs;
use std::path::Path;

use super::{documents, root};

/// Returns the targets of links and pictures in a text, outside of fenced code.
fn targets(text: &str) -> Vec<&str> {
    let prose = text.split("```").step_by(2);
    prose
        .flat_map(|prose| prose.split("](").skip(1))
        .filter_map(|rest| rest.split_once(')').map(|(target, _)| target))
        .collect()
}

/// Returns the anchor that GitHub gives to a heading.
fn anchor(heading: &str) -> String {
    let kept = |character: &char| character.is_alphanumeric() || " -_".contains(*character);
    let heading = heading.trim_start_matches('#').trim().to_lowercase();
    heading
        .chars()
        .filter(kept)
        .collect::<String>()
        .replace(' ', "-")
}

/// Returns the error of a broken link; None if it is valid.
fn link_error(from: &Path, target: &str) -> Option<String> {
    if target.starts_with("http://") || target.starts_with("https://") {
        return None;
    }
    let (path, heading) = target.split_once('#').unwrap_or((target, ""));
    let file = match path {
        "" => root().join(from),
        path => root().join(from).parent()?.join(path),
    };
    if !file.exists() {
        return Some(format!("{}: {path} does not exist", from.display()));
    }
    if heading.is_empty() {
        return None;
    }
    let text = fs::read_to_string(&file).unwrap_or_default();
    let mut headings = text.lines().filter(|line| line.starts_with('#'));
    match headings.any(|line| anchor(line) == heading) {
        true => None,
        false => Some(format!(
            "{}: {path} has no heading {heading}",
            from.display()
        )),
    }
}

#[test]
fn links_are_valid() {
    let mut checked = 0;
    let mut errors = Vec::new();
    for document in documents() {
        for target in targets(&document.text) {
            checked += 1;
            errors.extend(link_error(&document.path, target));
        }
    }
    assert!(errors.is_empty(), "{}", errors.join("\n"));
    assert!(checked > 100, "only {checked} links were found");
}
