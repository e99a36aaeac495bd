//! `trainer export`

use std::path::PathBuf;

use anyhow::{Context, bail, ensure};
use clap::Args;
use glimpse_core::model::linear::Basis as CompactBasis;
use glimpse_fitting::export::{to_c, to_json};
use glimpse_fitting::linear::{COMPACT_COMPONENTS, COMPACT_NODES, to_compact_bytes};
use glimpse_fitting::recipe::Metadata;

use super::geometry::GeometryArgs;
use super::{numbers, read_recipe};
use crate::output::{refuse_recipe, write_file};

/// An output format of recipes.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Format {
    /// The recipe file itself, as a device reads it.
    Postcard,
    /// A C header with the recipe's bytes, for the C library.
    C,
    /// All values that the fit needs, for other programs.
    Json,
    /// Model linear: the compact basis, with which a device turns coefficients into a BRDF.
    Basis,
}

/// Write a recipe in another format.
///
/// A recipe of `train --samples any` gets the directions of --geometry. A device fits it like any other.
///
/// Example: trainer export neural-n8.recipe --format json --out recipe.json
///          trainer export neural-n8.recipe --format postcard --strip --out flash.recipe
///          trainer export neural-n8.recipe --format c --strip --out recipe.h
///          trainer export linear-any.recipe --geometry line.csv --format postcard --out line.recipe
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Export {
    /// Recipe file, or the name of a bundled recipe
    recipe: PathBuf,
    #[command(flatten)]
    geometry: GeometryArgs,
    /// Output format
    #[arg(long, value_enum)]
    format: Format,
    /// With --format basis: number of principal components, 1 to 1024 [default: 24]
    #[arg(long, value_name = "COUNT", value_parser = numbers::number(1..=1024_usize))]
    components: Option<usize>,
    /// Output file
    #[arg(long, short)]
    out: PathBuf,
    /// Replace an existing file that differs
    #[arg(long)]
    force: bool,
    /// Remove the metadata, which only the trainer reads: limits, noise, scan time, training and materials (postcard
    /// and c only)
    #[arg(long)]
    strip: bool,
}

impl Export {
    pub(crate) fn run(&self) -> anyhow::Result<()> {
        if self.strip && !matches!(self.format, Format::Postcard | Format::C) {
            bail!("--strip has no effect: give --format postcard or --format c, or remove it");
        }
        if self.components.is_some() && !matches!(self.format, Format::Basis) {
            bail!("--components has no effect: give --format basis, or remove it");
        }
        refuse_recipe(&self.out, &self.recipe)?;
        let mut file = self.geometry.read_file(&self.recipe)?;
        if self.strip {
            file = file.with_metadata(&Metadata::default())?.into();
        }
        let bytes = match self.format {
            Format::C => to_c(&file).into_bytes(),
            Format::Postcard => file.bytes().to_vec(),
            Format::Basis => self.compact_basis()?,
            Format::Json => (serde_json::to_string_pretty(&to_json(&file)?)? + "\n").into_bytes(),
        };
        write_file(&self.out, &bytes, self.force)
    }

    /// Returns the recipe's basis at few enough nodes for a device.
    fn compact_basis(&self) -> anyhow::Result<Vec<u8>> {
        let named = read_recipe(&self.recipe)?;
        let basis = named.basis.with_context(|| {
            format!(
                "{} has no basis: --format basis takes a recipe of the model linear with its basis file next to it",
                self.recipe.display()
            )
        })?;
        let all = basis.components();
        let components = self.components.unwrap_or(COMPACT_COMPONENTS.min(all));
        ensure!(
            (1..=all).contains(&components),
            "--components {components} is out of range: this recipe's basis has {all}; give 1 to {all}"
        );
        let bytes = match CompactBasis::parse(basis.file()) {
            Ok(own) if own.nodes() == COMPACT_NODES && components == all => basis.file().to_vec(),
            _ => to_compact_bytes(&basis, components, COMPACT_NODES),
        };
        eprintln!(
            "compact basis: {components} of {all} components, {} bytes, valid for recipes of any n with the same basis",
            bytes.len()
        );
        Ok(bytes)
    }
}
