//! Figures stand between markers that name the command which prints them.

use super::{Document, with_figures};

const BEGIN: &str = "<!-- printed by: ";
const END: &str = "<!-- end of what is printed -->";

/// What a command has printed into a document.
pub(super) struct Printed<'a> {
    pub(super) command: &'a str,
    lines: Vec<&'a str>,
}

/// All that commands have printed into a document, and the lines that no command has.
fn parts(text: &str) -> Result<(Vec<Printed<'_>>, Vec<&str>), String> {
    let (mut printed, mut prose) = (Vec::<Printed<'_>>::new(), Vec::new());
    let mut open = false;
    for (number, line) in (1..).zip(text.lines()) {
        if let Some(rest) = line.strip_prefix(BEGIN) {
            if open {
                return Err(format!("line {number}: the marker before was not closed"));
            }
            let command = rest.strip_suffix(" -->");
            let command = command.ok_or_else(|| format!("line {number}: a marker ends in -->"))?;
            printed.push(Printed {
                command,
                lines: Vec::new(),
            });
            open = true;
        } else if line == END {
            if !open {
                return Err(format!("line {number}: closes what was not opened"));
            }
            open = false;
        } else if line.starts_with("<!--") {
            return Err(format!("line {number}: {line} is no marker that is known"));
        } else if let (true, Some(printed)) = (open, printed.last_mut()) {
            printed.lines.push(line);
        } else {
            prose.push(line);
        }
    }
    match open {
        true => Err("the last marker was not closed".into()),
        false => Ok((printed, prose)),
    }
}

pub(super) fn printed(document: &Document) -> Vec<Printed<'_>> {
    match parts(&document.text) {
        Ok((printed, _)) => printed,
        Err(what) => panic!("{}: {what}", document.path.display()),
    }
}

/// True for a row of a table with three figures or more.
fn is_row_of_figures(line: &str) -> bool {
    let digits = |cell: &str| cell.chars().filter(char::is_ascii_digit).count();
    let letters = |cell: &str| cell.chars().filter(|each| each.is_alphabetic()).count();
    let cells = line
        .split('|')
        .filter(|cell| digits(cell) > 0 && letters(cell) == 0);
    line.starts_with('|') && cells.count() >= 3
}

#[test]
fn markers_are_in_pairs_with_something_between() {
    let mut count = 0;
    for document in with_figures() {
        for printed in printed(&document) {
            count += 1;
            assert!(
                !printed.lines.is_empty(),
                "{}: nothing was printed by {}",
                document.path.display(),
                printed.command
            );
        }
    }
    assert!(count >= 6, "only {count} commands print into documents");
}

/// The document of what fits cost, the file of the same cycles, and the target that both are for.
const COSTS: &str = "core/docs/costs.md";
const CYCLES: &str = "trainer/recipes/cycles.csv";
const BOARD: &str = "thumbv7em-none-eabihf";

#[test]
fn cycles_of_bundled_recipes_are_those_that_the_firmware_s_tests_print() {
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
    assert!(expected.len() >= 5, "{COSTS} has its table");
    let text = std::fs::read_to_string(super::root().join(CYCLES)).expect("it is there");
    let mut found: Vec<&str> = text.lines().skip(1).collect();
    expected.sort_unstable();
    found.sort_unstable();
    assert_eq!(found, expected);
    for line in found {
        let (name, cycles) = line.split_once(',').expect("two columns");
        let bundled = glimpse_trainer::bundled::find(name).expect("it is bundled");
        assert_eq!(bundled.cycles(), cycles.parse().ok(), "{name}");
    }
}

/// A table whose cells come from several commands each, which the text beside it names: none prints it.
const OF_SEVERAL_COMMANDS: &str = "core/docs/basis.md";

#[test]
fn tables_of_figures_stand_between_markers() {
    let others = |document: &Document| !document.path.ends_with(OF_SEVERAL_COMMANDS);
    for document in with_figures().filter(others) {
        let (_, prose) = parts(&document.text).expect("markers in pairs");
        let row = prose.into_iter().find(|line| is_row_of_figures(line));
        assert_eq!(
            row,
            None,
            "{}: which command prints it?",
            document.path.display()
        );
    }
}

#[test]
fn markers_that_are_wrong_are_found() {
    let good = format!("a\n{BEGIN}b -->\n| 1 |\n{END}\nc\n");
    let (printed, prose) = parts(&good).expect("it is well-formed");
    assert_eq!(
        (printed[0].command, &printed[0].lines[..]),
        ("b", &["| 1 |"][..])
    );
    assert_eq!(prose, ["a", "c"]);
    for wrong in [
        format!("{BEGIN}b -->\n"),
        format!("{END}\n"),
        format!("{BEGIN}b\n{END}\n"),
        format!("{BEGIN}b -->\n{BEGIN}c -->\n{END}\n"),
        "<!-- printed with: b -->\n".to_owned(),
    ] {
        assert!(parts(&wrong).is_err(), "{wrong}");
    }
    assert!(is_row_of_figures("| Neural | .0615 | **.0305** | 1,283 |"));
    assert!(!is_row_of_figures("| 4 | 2 | bytes |"));
    assert!(!is_row_of_figures("|---|---|---|"));
}
