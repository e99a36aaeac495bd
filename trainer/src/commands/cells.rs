//! `--list`: what a command would do, as commands of its own, for whoever shares work out.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::parser::ValueSource;
use clap::{ArgMatches, Command};
use glimpse_materials::Source;
use serde::Serialize;

use super::print;

/// One piece of work that is done by a command of its own; a line of JSON.
#[derive(Serialize)]
pub(super) struct Cell {
    /// What it is called among all of the list.
    pub(super) name: String,
    /// The command, word by word.
    pub(super) command: Vec<String>,
    /// The same for a shell.
    pub(super) shell: String,
    /// What has to be there before: materials, and what other cells write.
    pub(super) inputs: Vec<String>,
    /// What it writes.
    pub(super) outputs: Vec<String>,
    /// Where it is kept while it lasts; the same command goes on from there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) checkpoint: Option<String>,
    /// True if all of it is there.
    pub(super) done: bool,
    /// What is there instead, in words; the command refuses to replace it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) in_the_way: Option<String>,
}

/// Prints one line for each.
pub(super) fn print_all(cells: &[Cell]) -> anyhow::Result<()> {
    let mut text = String::new();
    for cell in cells {
        text += &serde_json::to_string(cell)?;
        text.push('\n');
    }
    print(&text)
}

/// The words of a command for a shell.
pub(super) fn for_a_shell(words: &[String]) -> anyhow::Result<String> {
    shlex::try_join(words.iter().map(String::as_str)).context("a word cannot be quoted")
}

/// A path as JSON has it.
pub(super) fn text_of(path: &Path) -> anyhow::Result<String> {
    match path.to_str() {
        Some(text) => Ok(text.to_owned()),
        None => bail!(
            "{} is no UTF-8, and cannot be listed: give it another name",
            path.display()
        ),
    }
}

/// The paths among sources: what is built in is no file.
pub(super) fn paths_of<'s>(sources: impl IntoIterator<Item = &'s Source>) -> Vec<String> {
    let paths = sources.into_iter().filter(|source| !source.is_built_in());
    paths.map(|source| source.0.clone()).collect()
}

/// What was given on the command line to a subcommand.
pub(crate) struct Given {
    subcommand: String,
    /// Each by its name, and the word or words that give it again.
    words: Vec<(String, Vec<String>)>,
}

impl Given {
    /// What was given to the subcommand of a command line that was parsed.
    ///
    /// # Errors
    /// If it is no UTF-8.
    pub(crate) fn of(command: &Command, matches: &ArgMatches) -> anyhow::Result<Self> {
        let (subcommand, matches) = matches.subcommand().context("no subcommand was given")?;
        let command = command
            .find_subcommand(subcommand)
            .context("it is no subcommand")?;
        let mut words = Vec::new();
        for id in matches.ids().map(clap::Id::as_str) {
            let argument = command.get_arguments().find(|each| each.get_id() == id);
            // Groups of arguments have names too.
            let Some(argument) = argument else { continue };
            if matches.value_source(id) != Some(ValueSource::CommandLine) {
                continue;
            }
            let values = matches.get_raw(id).into_iter().flatten();
            let values = values.map(|value| text_of(Path::new(value)));
            let values = values.collect::<anyhow::Result<Vec<String>>>()?;
            let again = match argument.get_long() {
                None => values,
                Some(long) if argument.get_action().takes_values() => {
                    let each = values.iter().map(|value| format!("--{long}={value}"));
                    each.collect()
                }
                Some(long) => vec![format!("--{long}")],
            };
            words.push((id.to_owned(), again));
        }
        Ok(Self {
            subcommand: subcommand.to_owned(),
            words,
        })
    }

    /// The command without some of what was given, and with other words.
    pub(super) fn but(&self, without: &[&str], more: &[String]) -> Vec<String> {
        let kept = self
            .words
            .iter()
            .filter(|(id, _)| !without.contains(&&**id));
        let kept = kept.flat_map(|(_, words)| words.iter().cloned());
        ["trainer".to_owned(), self.subcommand.clone()]
            .into_iter()
            .chain(kept)
            .chain(more.iter().cloned())
            .collect()
    }
}

/// All of some paths as text.
pub(super) fn texts_of(paths: &[PathBuf]) -> anyhow::Result<Vec<String>> {
    paths.iter().map(|path| text_of(path)).collect()
}
