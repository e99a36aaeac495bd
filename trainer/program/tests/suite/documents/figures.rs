//! Figures in documents are between markers that name the command that prints them.

use super::{Document, with_figures};

const BEGIN: &str = "<!-- printed by: ";
const END: &str = "<!-- end of what is printed -->";

/// The output of a command in a document.
pub(super) struct Printed<'a> {
    pub(super) command: &'a str,
    lines: Vec<&'a str>,
}

/// Splits a document into the outputs of commands and the other lines.
fn parts(text: &str) -> Result<(Vec<Printed<'_>>, Vec<&str>), String> {
    let (mut printed, mut prose) = (Vec::<Printed<'_>>::new(), Vec::new());
    let mut open = false;
    for (number, line) in (1..).zip(text.lines()) {
        if let Some(rest) = line.strip_prefix(BEGIN) {
            if open {
                return Err(format!("line {number}: the previous marker is not closed"));
            }
            let command = rest.strip_suffix(" -->");
            let command =
                command.ok_or_else(|| format!("line {number}: the marker does not end in -->"))?;
            printed.push(Printed {
                command,
                lines: Vec::new(),
            });
            open = true;
        } else if line == END {
            if !open {
                return Err(format!("line {number}: no marker to close"));
            }
            open = false;
        } else if line.starts_with("<!-- print") {
            return Err(format!("line {number}: unknown marker {line}"));
        } else if let (true, Some(printed)) = (open, printed.last_mut()) {
            printed.lines.push(line);
        } else {
            prose.push(line);
        }
    }
    match open {
        true => Err("the last marker is not closed".into()),
        false => Ok((printed, prose)),
    }
}

pub(super) fn printed(document: &Document) -> Vec<Printed<'_>> {
    match parts(&document.text) {
        Ok((printed, _)) => printed,
        Err(reason) => panic!("{}: {reason}", document.path.display()),
    }
}

/// Returns true for a row of a table with at least three numbers.
fn is_row_of_figures(line: &str) -> bool {
    let digits = |cell: &str| cell.chars().filter(char::is_ascii_digit).count();
    let letters = |cell: &str| cell.chars().filter(|c| c.is_alphabetic()).count();
    let cells = line
        .split('|')
        .filter(|cell| digits(cell) > 0 && letters(cell) == 0);
    line.starts_with('|') && cells.count() >= 3
}

#[test]
fn markers_are_paired_and_nonempty() {
    let mut count = 0;
    for document in with_figures() {
        for printed in printed(&document) {
            count += 1;
            assert!(
                !printed.lines.is_empty(),
                "{}: no output of {}",
                document.path.display(),
                printed.command
            );
        }
    }
    assert!(count >= 5, "only {count} outputs of commands");
}

/// The document with the costs of fits, the file with the same cycles, and their target.
const COSTS: &str = "core/docs/costs.md";
const CYCLES: &str = "trainer/recipes/cycles.csv";
const BOARD: &str = "thumbv7em-none-eabihf";

#[test]
fn cycles_match_costs_document() {
    let costs = super::document(COSTS.into()).text;
    let mut expected: Vec<String> = Vec::new();
    for line in costs.lines() {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        let ["", BOARD, fit, _, _, _, cycles, ..] = cells[..] else {
            continue;
        };
        let recipe = match fit.rsplit_once('-') {
            Some((model, "completed")) => format!("{model}-n8"),
            Some((model, "masked")) => format!("{model}-n16-masked"),
            _ => continue,
        };
        expected.push(format!("{recipe},{}", cycles.replace(',', "")));
    }
    assert!(expected.len() >= 5, "no table in {COSTS}");
    let text = std::fs::read_to_string(super::root().join(CYCLES)).expect("the file exists");
    let mut found: Vec<&str> = text.lines().skip(1).collect();
    expected.sort_unstable();
    found.sort_unstable();
    assert_eq!(found, expected);
    for line in found {
        let (name, cycles) = line.split_once(',').expect("two columns");
        let bundled = glimpse_trainer::bundled::find(name).expect("a bundled recipe");
        assert_eq!(bundled.cycles(), cycles.parse().ok(), "{name}");
    }
}

/// A document with a table of numbers from several commands, which its text names.
const OF_SEVERAL_COMMANDS: &str = "core/docs/basis.md";

#[test]
fn tables_of_figures_have_markers() {
    let others = |document: &Document| !document.path.ends_with(OF_SEVERAL_COMMANDS);
    for document in with_figures().filter(others) {
        let (_, prose) = parts(&document.text).expect("markers in pairs");
        let row = prose.into_iter().find(|line| is_row_of_figures(line));
        assert_eq!(
            row,
            None,
            "{}: no marker names the command that prints this row",
            document.path.display()
        );
    }
}
