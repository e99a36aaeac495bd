//! `trainer recipes`

use std::ffi::OsStr;
use std::path::PathBuf;

use anyhow::{Context, bail};
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::error::{ContextKind, ContextValue};
use clap::{Arg, Args, Command, Subcommand};
use glimpse_core::recipe::Recipe;
use glimpse_materials::basis::Basis;
use glimpse_trainer::bundled::{self, BundledRecipe};
use glimpse_trainer::report::{Best, Cell, Column, Compare, Table};
use serde_json::{Value, json};

use super::output::{make_out, write_files_forced};
use super::{print, print_json};

/// List or write the bundled recipes, to scan with before anything is trained.
///
/// All of them were trained on the built-in procedural materials alone, so that they may be passed
/// on with your firmware; for arms that reach 80 degrees and keep 10 degrees apart, and readings with
/// 2 % of noise. A recipe trained on materials like yours has less loss: see `trainer train`.
///
/// Example: trainer recipes list
///          trainer recipes get neural-n8 --out recipes/
///          trainer plan recipes/neural-n8.recipe --blank readings.csv
#[derive(Args)]
#[command(verbatim_doc_comment, args_conflicts_with_subcommands = true)]
pub(crate) struct Recipes {
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    /// Print the names, sizes in bytes, and mean losses on materials that training never saw
    List(List),
    /// Write some of them to a directory, with the compact basis of those that need one
    Get(Get),
}

#[derive(Args)]
struct List {
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// The name that stands for all recipes.
const ALL: &str = "all";

#[derive(Args)]
struct Get {
    /// Their names, as `trainer recipes list` prints them; or `all`
    #[arg(
        required = true,
        value_name = "NAME",
        hide_possible_values = true,
        value_parser = NameParser
    )]
    names: Vec<String>,
    /// The directory to write NAME.recipe and, of the model linear, NAME.basis to
    #[arg(short, long, default_value = ".")]
    out: PathBuf,
    /// Replace other recipes of these names
    #[arg(long)]
    force: bool,
}

impl Recipes {
    pub(crate) fn run(&self) -> anyhow::Result<()> {
        match &self.action {
            Action::List(List { json: false }) => print(&list()?.to_text()),
            Action::List(List { json: true }) => print_json(&list_as_json()?),
            Action::Get(get) => get.run(),
        }
    }
}

/// A parser of names that suggests similar ones: by their letters, as clap does, or else those that hold all words
/// of the given one in any order.
#[derive(Clone)]
struct NameParser;

impl TypedValueParser for NameParser {
    type Value = String;

    fn parse_ref(
        &self,
        command: &Command,
        arg: Option<&Arg>,
        value: &OsStr,
    ) -> Result<String, clap::Error> {
        let parsed = PossibleValuesParser::new(names()).parse_ref(command, arg, value);
        parsed.map_err(|mut error| {
            let given = value.to_string_lossy();
            let has_all = |name: &&str| {
                given
                    .split('-')
                    .all(|word| name.split('-').any(|own| own == word))
            };
            let similar: Vec<String> = names().filter(has_all).map(str::to_owned).collect();
            if error.get(ContextKind::SuggestedValue).is_none() && !similar.is_empty() {
                error.insert(ContextKind::SuggestedValue, ContextValue::Strings(similar));
            }
            error
        })
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(names().map(PossibleValue::new)))
    }
}

/// All names that `trainer recipes get` takes.
fn names() -> impl Iterator<Item = &'static str> {
    let names = bundled::ALL.iter().map(|bundled| bundled.name);
    names.chain([ALL])
}

fn recipe_of(bundled: &BundledRecipe) -> anyhow::Result<Recipe<'static>> {
    let recipe = bundled.recipe();
    recipe.with_context(|| format!("the bundled recipe {}", bundled.name))
}

fn list_as_json() -> anyhow::Result<Value> {
    let entry = |bundled: &BundledRecipe| -> anyhow::Result<Value> {
        let recipe = recipe_of(bundled)?;
        let losses = bundled.losses().map(|losses| {
            json!({
                "procedural": losses.procedural,
                "merl": losses.merl,
                "rgl": losses.rgl,
            })
        });
        Ok(json!({
            "name": bundled.name,
            "model": recipe.model().name(),
            "samples": recipe.samples(),
            "takes_missing": recipe.tolerates_missing(),
            "checksum": format!("{:08x}", recipe.checksum()),
            "bytes": bundled.bytes.len(),
            "basis_bytes": bundled.basis().map(<[u8]>::len),
            "loss": losses,
        }))
    };
    bundled::ALL.iter().map(entry).collect()
}

fn list() -> anyhow::Result<Table> {
    let row = |bundled: &BundledRecipe| {
        let recipe = recipe_of(bundled)?;
        let mut row = vec![
            Cell::Text(bundled.name.to_owned()),
            Cell::Number(recipe.samples() as f64),
            Cell::Number(bundled.bytes.len() as f64),
        ];
        if let Some(losses) = bundled.losses() {
            let each = [losses.procedural, losses.merl, losses.rgl];
            row.extend(each.map(Cell::Number));
        }
        Ok(row)
    };
    Ok(Table {
        caption: format!(
            "Bundled recipes: mean loss on materials that training never saw. Each of the model linear \
             has a compact basis in addition, {} bytes",
            bundled::BASIS.len()
        ),
        columns: vec![
            Column::text("Recipe"),
            Column::number("n", 0, Best::None),
            Column::number("Bytes", 0, Best::None),
            Column::number("40 procedural", 4, Best::None),
            Column::number("80 of MERL's", 4, Best::None),
            Column::number("17 of RGL's", 4, Best::None),
        ],
        rows: bundled::ALL
            .iter()
            .map(row)
            .collect::<anyhow::Result<_>>()?,
        compare: Compare::Down,
    })
}

impl Get {
    fn run(&self) -> anyhow::Result<()> {
        let mut files = Vec::new();
        for bundled in self.chosen()? {
            let recipe = self.out.join(format!("{}.recipe", bundled.name));
            if let Some(basis) = bundled.basis() {
                files.push((Basis::beside(&recipe), basis.to_vec()));
            }
            files.push((recipe, bundled.bytes.to_vec()));
        }
        make_out(&self.out)?;
        write_files_forced(&files, self.force)
    }

    fn chosen(&self) -> anyhow::Result<Vec<&'static BundledRecipe>> {
        if self.names.iter().any(|name| name == ALL) {
            return Ok(bundled::ALL.iter().collect());
        }
        let find = |name: &String| match bundled::find(name) {
            Some(bundled) => Ok(bundled),
            None => bail!(
                "there is no bundled recipe `{name}`: `trainer recipes list` prints their names, and `trainer \
                 train` makes others"
            ),
        };
        self.names.iter().map(find).collect()
    }
}
