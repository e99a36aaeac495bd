//! `trainer convert`

use std::fs;
use std::path::PathBuf;

use anyhow::{Context, bail, ensure};
use clap::Args;
use glimpse_materials::files::has_content;
use glimpse_materials::{Format, Source};
use glimpse_trainer::conversion::{file_name, format_from_extension, loss_of_file, output_paths};
use serde_json::json;

use super::formats::{Files, FormatName, files_of};
use super::output::{file_as_json, refuse_source, write_files_forced};
use super::{load, print, print_json};

/// Convert a material to another format.
///
/// The output is read again, and its loss against IN is printed: the mean cosine-weighted
/// logarithmic error of `trainer evaluate`, 0 if both are equal. If IN has the output format
/// already, its files are copied. For NBRDF, a network is fitted to the material in a few seconds,
/// unless IN is a network itself. A material of `trainer fit` with the model neural is a network.
///
/// Example: trainer convert aurora_white_rgb.bsdf aurora_white.binary
///          trainer convert gold.binary gold_rgb.bsdf
///          trainer convert gold.binary gold --format nbrdf
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Convert {
    /// Material to convert: a source with a single material
    #[arg(value_name = "IN")]
    source: Source,
    /// File to write; for nbrdf one of the six files or NAME, for pab NAME
    #[arg(value_name = "OUT")]
    out: PathBuf,
    /// Output format [default: by the extension of OUT: .binary, .bsdf or .npy]
    #[arg(long, value_enum)]
    format: Option<FormatName>,
    /// Replace existing files
    #[arg(long)]
    force: bool,
    /// Print JSON: material, format, copied (true or false), files and loss
    #[arg(long)]
    json: bool,
}

impl Convert {
    pub(crate) fn run(&self, seed: u64) -> anyhow::Result<()> {
        let format = self.format()?;
        let outs = output_paths(format, &self.out)?;
        for out in &outs {
            refuse_source(out, &self.source)?;
        }
        let materials = load(&self.source)?;
        let [material] = &materials[..] else {
            bail!(
                "{} holds {} materials, but IN must be a single one: name its file",
                self.source,
                materials.len()
            );
        };
        let own = self.source.files()?;
        let is_own = |first: &PathBuf| Format::detect(first).is_ok_and(|own| own == format);
        let copied = own.first().is_some_and(is_own);
        let files: Vec<Vec<u8>> = match copied {
            true => {
                // Its number of files depends on its directions, so it does not match `outs`.
                ensure!(
                    format != Format::Pab,
                    "{} is in PAB-Opto's format already: copy its files",
                    self.source
                );
                eprintln!("{} has the output format already: copying it", self.source);
                let read = own.iter().map(|path| {
                    fs::read(path).with_context(|| format!("cannot read {}", path.display()))
                });
                read.collect::<anyhow::Result<_>>()?
            }
            false => {
                // Only the names of PAB-Opto's files depend on OUT here.
                let name = match format {
                    Format::Pab => file_name(&self.out)?,
                    _ => material.name(),
                };
                let files = files_of(&**material, format, name, seed)?.into_iter();
                files.map(|(_, bytes)| bytes).collect()
            }
        };
        let files: Files = outs.into_iter().zip(files).collect();
        for (path, bytes) in &files {
            ensure!(
                self.force || !path.is_file() || has_content(path, bytes),
                "{} exists: give --force to replace it, or another OUT",
                path.display()
            );
        }
        write_files_forced(&files, self.force)?;
        let (first, _) = &files[0];
        // A pipe cannot be read again.
        let loss = match first.is_file() {
            true => Some(loss_of_file(&**material, first)?),
            false => None,
        };
        match (self.json, loss) {
            (true, _) => print_json(&json!({
                "material": material.name(),
                "format": format.name(),
                "copied": copied,
                "files": files.iter().map(|(path, _)| file_as_json(path)).collect::<Vec<_>>(),
                "loss": loss,
            })),
            (false, Some(loss)) => print(&format!("loss {loss:.6}\n")),
            (false, None) => Ok(()),
        }
    }

    /// Returns the format of --format, or else of the output's extension.
    ///
    /// # Errors
    /// If the two differ, since other programs detect formats by extension, or if neither is known.
    fn format(&self) -> anyhow::Result<Format> {
        let by_extension = format_from_extension(&self.out);
        let out = self.out.display();
        match (self.format.map(Format::from), by_extension) {
            (Some(format), None) => Ok(format),
            (None, Some(format)) => Ok(format),
            (Some(format), Some(other)) if format == other => Ok(format),
            (Some(_), Some(other)) => bail!(
                "{out} has the extension of --format {}: change the extension, or remove --format",
                other.name()
            ),
            (None, None) => bail!(
                "the extension of {out} is not that of a format: use .binary, .bsdf or _fc1.npy, or \
                 give --format"
            ),
        }
    }
}
