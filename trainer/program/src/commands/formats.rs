//! Formats of materials, as named on the command line.

use std::path::PathBuf;

use anyhow::Context;
use glimpse_evaluation::conversion::{Encoded, OutputFormat, WrittenErrors};
use glimpse_fitting::choice::Choice;
use glimpse_materials::Material;
use serde::Serialize;
use serde_json::Value;

use crate::output::{file_as_json, write_files};

/// The files of a material in a format.
#[derive(Serialize)]
pub(super) struct WrittenFormat {
    format: String,
    files: Vec<Value>,
    /// The errors against the material; None for a pipe, which cannot be read again.
    #[serde(flatten)]
    pub(super) errors: Option<WrittenErrors>,
}

/// Writes a material in a format to paths, and reports the errors of the files on stderr.
pub(super) fn write(
    format: OutputFormat,
    encoded: &Encoded,
    material: &dyn Material,
    paths: Vec<PathBuf>,
    force: bool,
) -> anyhow::Result<WrittenFormat> {
    let bytes = encoded.files.iter().map(|(_, bytes)| bytes.clone());
    let files: Vec<_> = paths.into_iter().zip(bytes).collect();
    write_files(&files, force)?;
    let (first, _) = files.first().context("a format has no files")?;
    let errors = first.is_file().then(|| encoded.errors(material, first));
    let errors = errors.transpose()?;
    if let Some(errors) = &errors {
        let [before, after] = [errors.before, errors.after].map(|errors| {
            format!(
                "reciprocity error {:.3} and largest albedo {:.3}",
                errors.reciprocity, errors.albedo
            )
        });
        let loss = describe_loss(errors);
        eprintln!("{}: {loss}; {after}; before {before}", first.display());
    }
    Ok(WrittenFormat {
        format: format.name(),
        files: files.iter().map(|(path, _)| file_as_json(path)).collect(),
        errors,
    })
}

/// Describes the errors of written files against their material.
pub(super) fn describe_loss(errors: &WrittenErrors) -> String {
    let color = errors.delta_e;
    let color = color.map_or(String::new(), |error| format!(", color error {error:.2}"));
    format!("loss {:.6}{color}", errors.loss)
}
