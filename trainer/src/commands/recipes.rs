//! `trainer recipes`

use std::path::PathBuf;

use anyhow::{Context, bail};
use clap::{Args, Subcommand};
use glimpse_trainer::linear::Basis;
use glimpse_trainer::report::{Best, Cell, Column, Compare, Table};
use glimpse_trainer::shipped::{self, Shipped};

use super::output::{make_out, write_files_forced};
use super::print;

/// Recipes that come with this program, to scan with before anything is trained.
///
/// All of them were trained on the built-in procedural materials alone, so that they may be passed on with your
/// firmware; for arms that get to 80 degrees and no nearer to each other than 10, and readings with 2 % of noise. One
/// that was trained on materials like yours loses less: see `trainer train`.
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
    /// Print what there is: bytes, and the mean loss on materials that training never saw
    List,
    /// Write some of them to a folder, with the compact basis of those that need one
    Get(Get),
}

#[derive(Args)]
struct Get {
    /// Their names, as `trainer recipes list` prints them; or `all`
    #[arg(required = true)]
    names: Vec<String>,
    /// The folder to write NAME.recipe and, of the model linear, NAME.basis to
    #[arg(short, long, default_value = ".")]
    out: PathBuf,
    /// Replace other recipes of these names
    #[arg(long)]
    force: bool,
}

impl Recipes {
    pub(crate) fn run(&self) -> anyhow::Result<()> {
        match &self.action {
            Action::List => print(&list()?.to_text()),
            Action::Get(get) => get.run(),
        }
    }
}

fn list() -> anyhow::Result<Table> {
    let row = |shipped: &Shipped| {
        let recipe = shipped
            .recipe()
            .with_context(|| format!("the recipe {} of this program", shipped.name))?;
        let mut row = vec![
            Cell::Text(shipped.name.to_owned()),
            Cell::Number(recipe.samples() as f64),
            Cell::Number(shipped.bytes.len() as f64),
        ];
        if let Some(losses) = shipped.losses() {
            let each = [losses.procedural, losses.merl, losses.rgl];
            row.extend(each.map(Cell::Number));
        }
        Ok(row)
    };
    Ok(Table {
        caption: format!(
            "Recipes that come along: mean loss on materials that training never saw. Of the model linear \
             each has a compact basis besides, {} bytes",
            shipped::BASIS.len()
        ),
        columns: vec![
            Column::text("Recipe"),
            Column::number("n", 0, Best::None),
            Column::number("Bytes", 0, Best::None),
            Column::number("40 procedural", 4, Best::None),
            Column::number("80 of MERL's", 4, Best::None),
            Column::number("17 of RGL's", 4, Best::None),
        ],
        rows: shipped::ALL
            .iter()
            .map(row)
            .collect::<anyhow::Result<_>>()?,
        compare: Compare::Down,
    })
}

impl Get {
    fn run(&self) -> anyhow::Result<()> {
        let mut files = Vec::new();
        for shipped in self.chosen()? {
            let recipe = self.out.join(format!("{}.recipe", shipped.name));
            if let Some(basis) = shipped.basis() {
                files.push((Basis::beside(&recipe), basis.to_vec()));
            }
            files.push((recipe, shipped.bytes.to_vec()));
        }
        make_out(&self.out)?;
        write_files_forced(&files, self.force)
    }

    fn chosen(&self) -> anyhow::Result<Vec<&'static Shipped>> {
        if self.names.iter().any(|name| name == "all") {
            return Ok(shipped::ALL.iter().collect());
        }
        let find = |name: &String| match shipped::find(name) {
            Some(shipped) => Ok(shipped),
            None => bail!(
                "there is no recipe `{name}`: `trainer recipes list` names those that come along, and `trainer \
                 train` makes others"
            ),
        };
        self.names.iter().map(find).collect()
    }
}
