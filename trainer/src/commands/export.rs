//! `trainer export`

use std::path::PathBuf;

use anyhow::bail;
use clap::Args;
use glimpse_trainer::export::{RecipeFile, to_json, to_rust};

use super::write_file;

/// The formats.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Format {
    /// The recipe as the device reads it.
    Postcard,
    /// A module of Rust constants.
    Rust,
    /// Everything that is needed to redo the fit elsewhere.
    Json,
}

/// Write a recipe in another format.
///
/// Examples: trainer export neural-n8.recipe --format rust --out recipe.rs
///           trainer export neural-n8.recipe --format postcard --strip --out flash.recipe
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Export {
    /// The recipe file
    recipe: PathBuf,
    /// The format to write
    #[arg(long, value_enum)]
    format: Format,
    /// The file to write
    #[arg(long, short)]
    out: PathBuf,
    /// Leave out the names of the materials, which nobody reads on a device (postcard only)
    #[arg(long)]
    strip: bool,
}

impl Export {
    pub(crate) fn run(&self) -> anyhow::Result<()> {
        if self.strip && !matches!(self.format, Format::Postcard) {
            bail!("--strip is for what is flashed: it takes --format postcard");
        }
        let file = RecipeFile::read(&self.recipe)?;
        let recipe = file.recipe()?;
        let bytes = match self.format {
            Format::Postcard if self.strip => file.stripped()?.bytes().to_vec(),
            Format::Postcard => file.bytes().to_vec(),
            Format::Rust => to_rust(&recipe).into_bytes(),
            Format::Json => (serde_json::to_string_pretty(&to_json(&recipe))? + "\n").into_bytes(),
        };
        write_file(&self.out, &bytes)
    }
}
