//! Formats of materials, as named on the command line.

use std::path::PathBuf;

use anyhow::Context;
use glimpse_evaluation::conversion::{Encoded, WrittenErrors};
use glimpse_materials::Material;

/// A group of files that are written together: their paths and contents.
pub(super) type Files = Vec<(PathBuf, Vec<u8>)>;

/// Returns the errors of written files against their material, and reports them on stderr. None for a pipe, which cannot
/// be read again.
pub(super) fn written_errors(
    encoded: &Encoded,
    material: &dyn Material,
    files: &Files,
) -> anyhow::Result<Option<WrittenErrors>> {
    let (first, _) = files.first().context("a format has no files")?;
    if !first.is_file() {
        return Ok(None);
    }
    let errors = encoded.errors(material, first)?;
    let [before, after] = [errors.before, errors.after].map(|errors| {
        format!(
            "reciprocity error {:.3} and largest albedo {:.3}",
            errors.reciprocity, errors.albedo
        )
    });
    let loss = describe_loss(&errors);
    eprintln!("{}: {loss}; {after}; before {before}", first.display());
    Ok(Some(errors))
}

/// Describes the errors of written files against their material.
pub(super) fn describe_loss(errors: &WrittenErrors) -> String {
    let color = errors.delta_e;
    let color = color.map_or(String::new(), |error| format!(", color error {error:.2}"));
    format!("loss {:.6}{color}", errors.loss)
}
