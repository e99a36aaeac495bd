//! `trainer convert`

use std::fs;
use std::path::PathBuf;

use anyhow::{Context, bail, ensure};
use clap::Args;
use glimpse_materials::files::holds;
use glimpse_materials::{Format, Source};
use glimpse_trainer::conversion::{format_of_ending, loss_of, name_of, paths};
use serde_json::json;

use super::formats::{Files, FormatName, files_of};
use super::output::{file_as_json, refuse_source, write_files_forced};
use super::{load, print, print_json};

/// Write a material in another format.
///
/// What is written is read again and compared with IN: its loss (mean cosine-weighted logarithmic
/// error, as `trainer evaluate` has it) is the answer, 0 where both are the same. IN's own format is
/// copied. A network is fitted to anything that is none, which takes some seconds; what `trainer fit`
/// found by the model neural is one.
///
/// Example: trainer convert aurora_white_rgb.bsdf aurora_white.binary
///          trainer convert gold.binary gold_rgb.bsdf
///          trainer convert gold.binary gold --format nbrdf
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Convert {
    /// The material: a source of one
    #[arg(value_name = "IN")]
    source: Source,
    /// The file to write; for NBRDF one of the six, or NAME alone; for pab NAME
    #[arg(value_name = "OUT")]
    out: PathBuf,
    /// The format to write [default: by OUT's ending, .binary, .bsdf or .npy]
    #[arg(long, value_enum)]
    format: Option<FormatName>,
    /// Replace files that are there
    #[arg(long)]
    force: bool,
    /// Print JSON: material, format, copied (or converted), files and loss
    #[arg(long)]
    json: bool,
}

impl Convert {
    pub(crate) fn run(&self, seed: u64) -> anyhow::Result<()> {
        let format = self.format()?;
        let outs = paths(format, &self.out)?;
        for out in &outs {
            refuse_source(out, &self.source)?;
        }
        let materials = load(&self.source)?;
        let [material] = &materials[..] else {
            bail!(
                "{} holds {} materials, and one is converted at a time: name its file",
                self.source,
                materials.len()
            );
        };
        let own = self.source.files()?;
        let is_own = |first: &PathBuf| Format::of(first).is_ok_and(|own| own == format);
        let copied = own.first().is_some_and(is_own);
        let files: Vec<Vec<u8>> = match copied {
            true => {
                // Its directions are those of whoever measured it, and its files as many.
                ensure!(
                    format != Format::Pab,
                    "{} is PAB-Opto's text already: copy its files",
                    self.source
                );
                eprintln!("{} has that format already: it is copied", self.source);
                let read = own.iter().map(|path| {
                    fs::read(path).with_context(|| format!("cannot read {}", path.display()))
                });
                read.collect::<anyhow::Result<_>>()?
            }
            false => {
                // A single file has whatever name was given.
                let name = match format {
                    Format::Pab => name_of(&self.out)?,
                    _ => material.name(),
                };
                let files = files_of(&**material, format, name, seed)?.into_iter();
                files.map(|(_, bytes)| bytes).collect()
            }
        };
        let files: Files = outs.into_iter().zip(files).collect();
        for (path, bytes) in &files {
            ensure!(
                self.force || !path.is_file() || holds(path, bytes),
                "{} is there: give --force to replace it, or another OUT",
                path.display()
            );
        }
        write_files_forced(&files, self.force)?;
        let (first, _) = &files[0];
        // A pipe cannot be read again.
        let loss = match first.is_file() {
            true => Some(loss_of(&**material, first)?),
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

    /// What was asked for, or what the output's ending stands for; both are the same if both are
    /// there, since other people's programs go by endings.
    fn format(&self) -> anyhow::Result<Format> {
        let by_ending = format_of_ending(&self.out);
        let out = self.out.display();
        match (self.format.map(Format::from), by_ending) {
            (Some(format), None) => Ok(format),
            (None, Some(format)) => Ok(format),
            (Some(format), Some(meant)) if format == meant => Ok(format),
            (Some(_), Some(meant)) => bail!(
                "{out} ends as --format {} does, and another one is asked for: give OUT that \
                 one's ending, or leave out --format",
                meant.name()
            ),
            (None, None) => bail!(
                "{out} does not say in which format to write: end it with .binary, .bsdf or \
                 _fc1.npy, or give --format"
            ),
        }
    }
}
