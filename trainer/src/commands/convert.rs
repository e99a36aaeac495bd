//! `trainer convert`

use std::path::PathBuf;

use anyhow::{Context, ensure};
use clap::Args;
use glimpse_materials::{Format, Material, Reciprocal, Source};
use glimpse_trainer::conversion::{
    Encoded, OutputFormat, encode, file_name, loss_of_file, output_paths,
};
use serde_json::json;

use super::formats::{self, Files};
use super::output::{file_as_json, refuse_source, write_files};
use super::{emit, load_single};

/// Convert a material to another format.
///
/// The output is read again, and its loss against IN is printed: the mean cosine-weighted
/// logarithmic error of `trainer evaluate`, 0 if both are equal. For NBRDF, a network is fitted to the material in a few seconds,
/// unless IN is a network itself. A material of `trainer fit` with the model neural is a network.
///
/// The formats principled, gltf and materialx hold the parameters of a renderer's shading model that
/// approximates IN. The loss of this approximation and its color error (mean CIEDE2000 of a sphere)
/// are printed.
///
/// With --reciprocal, OUT has the mean of IN and of IN with light and sensor exchanged, as renderers
/// expect that trace light from both ends. A network of the model neural is not reciprocal.
///
/// Example: trainer convert aurora_white_rgb.bsdf aurora_white.binary
///          trainer convert gold.binary gold_rgb.bsdf
///          trainer convert gold.binary gold --format nbrdf
///          trainer convert gold.binary gold.gltf
///          trainer convert gold/material.json gold_rgb.bsdf --reciprocal
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Convert {
    /// Material to convert: a source with a single material
    #[arg(value_name = "IN")]
    source: Source,
    /// File to write; for nbrdf one of the six files or NAME, for pab NAME
    #[arg(value_name = "OUT")]
    out: PathBuf,
    /// Output format [default: by the ending of OUT: .binary, .bsdf, _spec.bsdf, .npy, .gltf, .mtlx or
    /// _principled.json]
    #[arg(long, value_parser = formats::parser())]
    format: Option<OutputFormat>,
    /// Write the mean of both orders of light and sensor
    #[arg(long)]
    reciprocal: bool,
    /// Replace existing files that differ
    #[arg(long)]
    force: bool,
    /// Print JSON: material, format, copied (true or false), files, loss and delta_e
    #[arg(long)]
    json: bool,
}

impl Convert {
    pub(crate) fn run(&self, seed: u64) -> anyhow::Result<()> {
        let format = OutputFormat::choose(self.format, &self.out)?;
        let outs = output_paths(format, &self.out)?;
        for out in &outs {
            refuse_source(out, &self.source)?;
        }
        let loaded = load_single(&self.source)?;
        let mean = match self.reciprocal {
            true => Some(self.mean(&*loaded, format)?),
            false => None,
        };
        let material = match &mean {
            Some(mean) => mean as &dyn Material,
            None => &*loaded,
        };
        let own = self.source.files()?;
        let is_own = |first: &PathBuf| {
            Format::detect(first).is_ok_and(|own| OutputFormat::Brdf(own) == format)
        };
        ensure!(
            self.reciprocal || !own.first().is_some_and(is_own),
            "{} has the format {} already: copy its files",
            self.source,
            format.name()
        );
        // Only the names of PAB-Opto's files depend on OUT here.
        let name = match format {
            OutputFormat::Brdf(Format::Pab) => file_name(&self.out)?,
            _ => material.name(),
        };
        eprintln!("converting {} to {}", material.name(), format.name());
        let Encoded { files, metrics } = encode(material, format, name, seed)?;
        let files = files.into_iter().map(|(_, bytes)| bytes);
        let files: Files = outs.into_iter().zip(files).collect();
        write_files(&files, self.force)?;
        let (first, _) = &files[0];
        // A pipe cannot be read again.
        let loss = match metrics {
            Some(metrics) => Some(metrics.loss),
            None if first.is_file() => Some(loss_of_file(material, first)?),
            None => None,
        };
        let delta_e = metrics.map(|metrics| metrics.delta_e);
        let report = json!({
            "material": material.name(),
            "format": format.name(),
            "files": files.iter().map(|(path, _)| file_as_json(path)).collect::<Vec<_>>(),
            "loss": loss,
            "delta_e": delta_e,
        });
        emit(self.json, &report, || {
            let loss = loss.map(|loss| format!("loss {loss:.6}"));
            let color = delta_e.map(|error| format!("color error {error:.2}"));
            let stated: Vec<String> = loss.into_iter().chain(color).collect();
            stated.join(", ") + if stated.is_empty() { "" } else { "\n" }
        })
    }

    /// Returns the mean of both orders of a material.
    ///
    /// # Errors
    /// If the material is reciprocal, or the format's BRDF is not.
    fn mean<'m>(
        &self,
        material: &'m dyn Material,
        format: OutputFormat,
    ) -> anyhow::Result<Reciprocal<'m>> {
        ensure!(
            format != OutputFormat::Brdf(Format::Nbrdf),
            "a network is not reciprocal: remove --reciprocal, or give another format than nbrdf"
        );
        Reciprocal::of(material)
            .with_context(|| format!("{} is reciprocal: remove --reciprocal", self.source))
    }
}
