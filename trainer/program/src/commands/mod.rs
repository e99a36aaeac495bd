//! The subcommands, one file each. Results go to stdout or --out, messages to stderr.

mod adaptive;
pub(crate) mod bench;
pub(crate) mod compare;
pub(crate) mod convert;
pub(crate) mod evaluate;
mod evaluation_report;
mod expected_loss;
pub(crate) mod export;
pub(crate) mod fit;
mod fits;
mod formats;
mod geometry;
pub(crate) mod inspect;
mod limits;
mod lock;
pub(crate) mod message;
pub(crate) mod next;
pub(crate) mod numbers;
pub(crate) mod photo;
pub(crate) mod plan;
pub(crate) mod query;
pub(crate) mod quickstart;
pub(crate) mod recipes;
pub(crate) mod render;
pub(crate) mod reproduce;
pub(crate) mod train;
mod training_overlap;
pub(crate) mod virtual_scanner;

use std::io::{self, Write};
use std::path::Path;

use anyhow::{Context, bail, ensure};
use glimpse_fitting::measurement::NamedRecipe;
use glimpse_fitting::recipe::RecipeFile;
use glimpse_materials::{Material, MaterialsAndShares, Source, Sources};
use serde::Serialize;

/// The default recipe of readings at any directions.
pub(crate) const LINEAR_ANY: &str = "linear-any";
/// The largest number of names in a message.
const MAX_NAMES: usize = 5;

/// Reads a recipe with a pattern and, for the model linear, its basis file next to it.
pub(crate) fn read_recipe(path: &Path) -> anyhow::Result<NamedRecipe> {
    let named = NamedRecipe::read(path)?;
    require_pattern(&named.file, &path.display().to_string())?;
    Ok(named)
}

/// Refuses a recipe without a pattern.
pub(crate) fn require_pattern(file: &RecipeFile, name: &str) -> anyhow::Result<()> {
    ensure!(
        file.recipe().samples() > 0,
        "{name} is for readings at any directions, so this needs --geometry: give it here, or to `trainer export`, which \
         writes a recipe for those directions"
    );
    Ok(())
}

/// Joins the first few names.
pub(crate) fn first_of(mut names: Vec<&str>) -> String {
    if names.len() > MAX_NAMES {
        names.splice(MAX_NAMES.., ["..."]);
    }
    names.join(", ")
}

/// Loads the materials of a source, as [`load_measured`] does.
///
/// # Errors
/// If the BRDF of a material is unknown at some directions.
pub(crate) fn load(source: &Source) -> anyhow::Result<Vec<Box<dyn Material>>> {
    let materials = load_measured(source)?;
    for material in &materials {
        material.require_complete()?;
    }
    Ok(materials)
}

/// Loads the materials of a source, whose BRDFs are NaN at unknown directions. Reports their number, unmeasured directions,
/// unread parts of files, and skipped entries of a directory, on stderr.
pub(crate) fn load_measured(source: &Source) -> anyhow::Result<Vec<Box<dyn Material>>> {
    // Before loading, which fails if all entries are skipped.
    let skipped = source.skipped_entries().unwrap_or_default();
    if !skipped.is_empty() {
        eprintln!(
            "skipped {} entries of {source}, a directory without material.json or a file without the ending of a format: {}",
            skipped.len(),
            first_of(skipped.iter().map(|name| &name[..]).collect())
        );
    }
    let materials = source.load_measured()?;
    match &materials[..] {
        [one] => eprintln!("1 material from {source}: {}", one.name()),
        more => eprintln!("{} materials from {source}", more.len()),
    }
    for material in &materials {
        for remark in material.remarks() {
            eprintln!("{}: {remark}", material.name());
        }
    }
    Ok(materials)
}

/// Loads the only material of a source.
///
/// # Errors
/// If the source has several materials.
pub(crate) fn load_single(source: &Source) -> anyhow::Result<Box<dyn Material>> {
    let mut materials = load(source)?;
    match (materials.pop(), materials.len()) {
        (Some(material), 0) => Ok(material),
        (_, others) => bail!(
            "{source} holds {} materials, but a single one is needed: name its file",
            others + 1
        ),
    }
}

/// Loads the materials of several sources, as [`load`] does.
pub(crate) fn load_all(sources: &Sources) -> anyhow::Result<MaterialsAndShares> {
    let lists = sources.sources.iter().map(load);
    Ok(sources.join(lists.collect::<Result<_, _>>()?)?)
}

/// Prints a report to stdout, as JSON or as text.
pub(crate) fn emit(
    json: bool,
    report: &impl Serialize,
    text: impl FnOnce() -> String,
) -> anyhow::Result<()> {
    match json {
        true => print_json(report),
        false => print(&text()),
    }
}

/// Prints JSON to stdout.
pub(crate) fn print_json(value: &impl Serialize) -> anyhow::Result<()> {
    print(&(serde_json::to_string_pretty(value)? + "\n"))
}

/// Prints to stdout. A closed pipe, as after `trainer ... | head`, is not an error.
pub(crate) fn print(text: &str) -> anyhow::Result<()> {
    match io::stdout().write_all(text.as_bytes()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(error).context("cannot write to standard output")
        }
        _ => Ok(()),
    }
}
