//! `trainer recipes`

use std::path::PathBuf;

use clap::builder::PossibleValuesParser;
use clap::{Args, Subcommand};
use glimpse_fitting::bundled;
use glimpse_materials::basis::BasisTable;

use super::emit;
use crate::output::{create_out_folder, write_files};
use crate::report::Table;

/// List or write the bundled recipes, which need no training.
///
/// They were trained on the built-in procedural materials and on 17 of RGL's (CC0), so you may
/// redistribute them with your firmware. They are for arms that reach 80 degrees from the normal and
/// stay 10 degrees apart, and for readings with 2 % noise. A recipe trained on materials like yours
/// has a lower loss: see `trainer train`.
///
/// Names are MODEL-nN for N samples. `-masked` recipes tolerate missing readings. So do `-16s`
/// recipes, which were trained for a scan of 16 s at 10 degrees per second, with 0.5 s at each
/// sample.
///
/// Example: trainer recipes list
///          trainer recipes get neural-n8 --out recipes/
///          trainer plan recipes/neural-n8.recipe --blank readings.csv
#[derive(Subcommand)]
#[command(verbatim_doc_comment)]
pub(crate) enum Recipes {
    /// Print names, sizes in bytes, and the accuracy on unseen materials
    List {
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
    /// Write recipes to a directory, with their compact basis if they need one
    Get(Get),
}

/// The argument that selects all recipes.
const ALL: &str = "all";

#[derive(Args)]
pub(crate) struct Get {
    /// Names from `trainer recipes list`, or `all`
    #[arg(
        required = true,
        value_name = "NAME",
        hide_possible_values = true,
        value_parser = PossibleValuesParser::new(names())
    )]
    names: Vec<String>,
    /// Output directory for NAME.recipe and, for the model linear, NAME.basis
    #[arg(short, long, default_value = ".")]
    out: PathBuf,
    /// Replace existing files that differ
    #[arg(long)]
    force: bool,
}

impl Recipes {
    pub(crate) fn run(&self) -> anyhow::Result<()> {
        match self {
            Self::List { json } => {
                let entries = bundled::entries()?;
                let table = Table::of_records("recipes", &entries)?;
                emit(*json, &entries, || {
                    format!("{}\n{}", caption(), table.to_markdown())
                })
            }
            Self::Get(get) => get.run(),
        }
    }
}

/// Returns all names that `trainer recipes get` accepts.
fn names() -> impl Iterator<Item = &'static str> {
    let names = bundled::ALL.iter().map(|bundled| bundled.name);
    names.chain([ALL])
}

/// Describes the list.
fn caption() -> String {
    format!(
        "Bundled recipes, and their mean losses on unseen materials: 40 procedural, 80 of MERL, and 17 of RGL (by \
         cross-validation), and the mean color error (CIEDE2000) of the spheres of MERL's. Recipes of the model linear also need the compact basis of {} \
         bytes, and those for readings at any directions (n = 0) one of {}.",
        bundled::BASIS.len(),
        bundled::ANY_BASIS.len()
    )
}

impl Get {
    fn run(&self) -> anyhow::Result<()> {
        let is_selected = |name: &str| self.names.iter().any(|given| given == name);
        let selected = bundled::ALL.iter();
        let selected = selected.filter(|bundled| is_selected(ALL) || is_selected(bundled.name));
        let mut files = Vec::new();
        for bundled in selected {
            let recipe = self.out.join(format!("{}.recipe", bundled.name));
            if let Some(basis) = bundled.basis() {
                files.push((BasisTable::path_for(&recipe), basis.to_vec()));
            }
            files.push((recipe, bundled.bytes.to_vec()));
        }
        create_out_folder(&self.out)?;
        write_files(&files, self.force)
    }
}
