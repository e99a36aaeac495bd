//! `trainer convert`

use std::path::PathBuf;

use anyhow::ensure;
use clap::Args;
use glimpse_evaluation::conversion::{OutputFormat, encode, file_name, output_paths};
use glimpse_fitting::choice::Choice;
use glimpse_materials::{Format, Source};
use serde::Serialize;

use super::formats::{self, WrittenFormat, describe_loss};
use super::{emit, load_single};
use crate::output::refuse_source;

/// Convert a material to another format.
///
/// The output is read again, and its loss against IN is printed: the mean cosine-weighted
/// logarithmic error of `trainer evaluate`, 0 if both are equal. For NBRDF, a network is fitted to
/// the material in a few seconds, unless IN is a network itself. A material of `trainer fit` with
/// the model neural is a network.
///
/// The formats principled, gltf and openpbr hold the parameters of a renderer's shading model that
/// approximates IN. The loss of this approximation and its color error (mean CIEDE2000 of a sphere)
/// are printed.
///
/// PHYSICS. Fits and measurements are not quite reciprocal, and may reflect more light than they
/// receive. Tables (all formats but these and nbrdf) are changed to be reciprocal and to have an
/// albedo of at most 1. The errors before and after are printed: the mean change if light and sensor
/// are exchanged, relative to the BRDF, and the largest albedo. Formats of parameters cannot be
/// changed, so their errors remain.
///
/// Example: trainer convert aurora_white_rgb.bsdf aurora_white.binary
///          trainer convert gold.binary gold_rgb.bsdf
///          trainer convert gold.binary gold --format nbrdf
///          trainer convert gold.binary gold.gltf
///          trainer convert gold/material.json gold_rgb.bsdf
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Convert {
    /// Material to convert: a source with a single material
    #[arg(value_name = "IN")]
    source: Source,
    /// File to write; for nbrdf one of the six files or NAME, for pab NAME
    #[arg(value_name = "OUT")]
    out: PathBuf,
    /// Output format [default: by the ending of OUT: .binary, .bsdf, _spec.bsdf, .ssdd, _brdf.xompt, _fc1.npy,
    /// .gltf, .mtlx or _principled.json]
    #[arg(long, value_enum)]
    format: Option<OutputFormat>,
    /// Write a table of the BRDF as it is, even if it is not reciprocal or its albedo is above 1
    #[arg(long)]
    as_fitted: bool,
    /// Replace existing files that differ
    #[arg(long)]
    force: bool,
    /// Print JSON: material, format, files, loss and delta_e; and before and after, each with reciprocity
    /// and albedo
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Report<'m> {
    material: &'m str,
    #[serde(flatten)]
    written: WrittenFormat,
}

impl Convert {
    pub(crate) fn run(&self, seed: u64) -> anyhow::Result<()> {
        let format = OutputFormat::choose(self.format, &self.out)?;
        let outs = output_paths(format, &self.out)?;
        for out in &outs {
            refuse_source(out, &self.source)?;
        }
        let material = load_single(&self.source)?;
        // Only the names of PAB-Opto's files depend on OUT here.
        let name = match format {
            OutputFormat::Brdf(Format::Pab) => file_name(&self.out)?,
            _ => material.name(),
        };
        eprintln!("converting {} to {}", material.name(), format.name());
        let encoded = encode(&*material, format, name, seed, self.as_fitted)?;
        let own = self.source.files()?;
        let is_own = |first: &PathBuf| {
            Format::detect(first).is_ok_and(|own| OutputFormat::Brdf(own) == format)
        };
        ensure!(
            encoded.is_changed || !own.first().is_some_and(is_own),
            "{} has the format {} already: copy its files",
            self.source,
            format.name()
        );
        let written = formats::write(format, &encoded, &*material, outs, self.force)?;
        let loss = written.errors.as_ref().map(describe_loss);
        let report = Report {
            material: material.name(),
            written,
        };
        emit(self.json, &report, || {
            loss.map_or_else(String::new, |loss| loss + "\n")
        })
    }
}
