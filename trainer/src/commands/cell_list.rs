//! `--list`: prints the work of a command as separate commands, called cells, for a cluster's scheduler.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::parser::ValueSource;
use clap::{ArgMatches, Command};
use glimpse_materials::Source;
use serde::Serialize;

use super::print;

/// One training or evaluation with a command of its own, printed as a line of JSON.
#[derive(Serialize)]
pub(super) struct ListedCell {
    /// The unique name within the list.
    pub(super) name: String,
    /// The words of the command.
    pub(super) command: Vec<String>,
    /// Files that must exist first: materials, and outputs of other cells.
    pub(super) inputs: Vec<String>,
    /// Files that the command writes.
    pub(super) outputs: Vec<String>,
    /// The checkpoint of an unfinished run, from which the same command resumes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) checkpoint: Option<String>,
    /// True if all outputs exist.
    pub(super) done: bool,
    /// Description of an existing file that the command refuses to replace.
    #[serde(rename = "in_the_way", skip_serializing_if = "Option::is_none")]
    pub(super) conflict: Option<String>,
}

/// Prints one line for each cell.
pub(super) fn print_cells(cells: &[ListedCell]) -> anyhow::Result<()> {
    let mut text = String::new();
    for cell in cells {
        text += &serde_json::to_string(cell)?;
        text.push('\n');
    }
    print(&text)
}

/// Converts a path to text, for JSON.
///
/// # Errors
/// If the path is not UTF-8.
pub(super) fn path_text(path: &Path) -> anyhow::Result<String> {
    match path.to_str() {
        Some(text) => Ok(text.to_owned()),
        None => bail!(
            "{} is not UTF-8 and cannot be listed: rename it",
            path.display()
        ),
    }
}

/// Converts paths to text, as [`path_text`] does.
pub(super) fn path_texts(paths: &[PathBuf]) -> anyhow::Result<Vec<String>> {
    paths.iter().map(|path| path_text(path)).collect()
}

/// Returns the paths of all sources except the built-in ones.
pub(super) fn source_paths<'s>(sources: impl IntoIterator<Item = &'s Source>) -> Vec<String> {
    let paths = sources.into_iter().filter(|source| !source.is_built_in());
    paths.map(|source| source.0.clone()).collect()
}

/// The subcommand and the arguments that were given on the command line.
pub(crate) struct CommandLine {
    subcommand: String,
    /// The id of each argument, and the words that give it on a command line.
    arguments: Vec<(String, Vec<String>)>,
}

impl CommandLine {
    /// Collects the arguments of a parsed command line; defaults are not included.
    ///
    /// # Errors
    /// If the subcommand is missing, or an argument is not UTF-8.
    pub(crate) fn new(command: &Command, matches: &ArgMatches) -> anyhow::Result<Self> {
        let (subcommand, matches) = matches.subcommand().context("no subcommand was given")?;
        let command = command
            .find_subcommand(subcommand)
            .with_context(|| format!("{subcommand} is not a subcommand"))?;
        let mut arguments = Vec::new();
        for id in matches.ids().map(clap::Id::as_str) {
            let argument = command
                .get_arguments()
                .find(|argument| argument.get_id() == id);
            // The ids include argument groups.
            let Some(argument) = argument else { continue };
            if matches.value_source(id) != Some(ValueSource::CommandLine) {
                continue;
            }
            let values = matches.get_raw(id).into_iter().flatten();
            let values = values.map(|value| path_text(Path::new(value)));
            let values = values.collect::<anyhow::Result<Vec<String>>>()?;
            let words = match argument.get_long() {
                None => values,
                Some(long) if argument.get_action().takes_values() => {
                    let words = values.iter().map(|value| format!("--{long}={value}"));
                    words.collect()
                }
                Some(long) => vec![format!("--{long}")],
            };
            arguments.push((id.to_owned(), words));
        }
        Ok(Self {
            subcommand: subcommand.to_owned(),
            arguments,
        })
    }

    /// Returns the words of the command, without the arguments that have these ids.
    pub(super) fn words_without(&self, ids: &[&str]) -> Vec<String> {
        let kept = self
            .arguments
            .iter()
            .filter(|(id, _)| !ids.contains(&&**id));
        let kept = kept.flat_map(|(_, words)| words.iter().cloned());
        ["trainer".to_owned(), self.subcommand.clone()]
            .into_iter()
            .chain(kept)
            .collect()
    }
}
