//! `trainer export`

use std::path::PathBuf;

use anyhow::bail;
use clap::Args;
use glimpse_materials::basis::Basis;
use glimpse_trainer::export::{to_c, to_csv, to_json, to_rust};
use glimpse_training::recipe::RecipeFile;

use super::export_basis::compact_basis;
use super::numbers;
use super::output::{refuse_input, write_file_forced};

/// The formats.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Format {
    /// The recipe as the device reads it.
    Postcard,
    /// A module of Rust constants.
    Rust,
    /// A C header with the recipe's bytes, for the C library.
    C,
    /// Where to measure: the samples' angles, in degrees.
    Csv,
    /// Everything that is needed to redo the fit elsewhere.
    Json,
    /// Model linear: the compact basis, by which a device makes a BRDF of its coefficients.
    Basis,
}

/// Write a recipe in another format.
///
/// Examples: trainer export neural-n8.recipe --format rust --out recipe.rs
///           trainer export neural-n8.recipe --format postcard --strip --out flash.recipe
///           trainer export neural-n8.recipe --format c --strip --out recipe.h
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Export {
    /// The recipe file
    recipe: PathBuf,
    /// The format to write
    #[arg(long, value_enum)]
    format: Format,
    /// With --format basis: principal components that are kept, 1 to 1024 [default: 24]
    #[arg(long, value_name = "COUNT", value_parser = numbers::whole(1..=1024_usize))]
    components: Option<usize>,
    /// The file to write
    #[arg(long, short)]
    out: PathBuf,
    /// Replace another recipe, the basis of one, a material or a sheet of readings
    #[arg(long)]
    force: bool,
    /// Leave out the names of the materials, which nobody reads on a device (postcard and c)
    #[arg(long)]
    strip: bool,
}

impl Export {
    pub(crate) fn run(&self) -> anyhow::Result<()> {
        if self.strip && !matches!(self.format, Format::Postcard | Format::C) {
            bail!("--strip is for what is flashed: it takes --format postcard or c");
        }
        if self.components.is_some() && !matches!(self.format, Format::Basis) {
            bail!("--components is for --format basis: a recipe keeps all of its components");
        }
        refuse_input(&self.out, &self.recipe)?;
        refuse_input(&self.out, &Basis::beside(&self.recipe))?;
        let file = RecipeFile::read(&self.recipe)?;
        let recipe = file.recipe();
        let bytes = match self.format {
            Format::Postcard if self.strip => file.stripped()?.bytes().to_vec(),
            Format::C if self.strip => to_c(file.stripped()?.bytes())?.into_bytes(),
            Format::C => to_c(file.bytes())?.into_bytes(),
            Format::Csv => to_csv(&recipe).into_bytes(),
            Format::Postcard => file.bytes().to_vec(),
            Format::Rust => to_rust(&recipe)?.into_bytes(),
            Format::Basis => compact_basis(&self.recipe, self.components)?,
            Format::Json => (serde_json::to_string_pretty(&to_json(&recipe)?)? + "\n").into_bytes(),
        };
        write_file_forced(&self.out, &bytes, self.force)
    }
}
