//! Names of materials, derived from file names.

use std::path::Path;

use crate::SourceError;
use crate::error::Defect;

/// Extensions of files that hold one material each.
const EXTENSIONS: [&str; 4] = [".binary", ".bsdf", ".ssdd", "_brdf.xompt"];
/// Ends of the names of RGL's files.
const RGB: &str = "_rgb";
const SPECTRA: &str = "_spec";

/// Returns `NAME` of a path `.../NAME.binary` or `.../NAME.bsdf`, or None for any other path.
pub(super) fn name_by_extension(path: &Path) -> Option<String> {
    let name = path.file_name()?.to_str()?;
    let name = EXTENSIONS
        .iter()
        .find_map(|extension| name.strip_suffix(extension))?;
    let is_empty = [RGB, SPECTRA].contains(&name);
    (!is_empty && is_valid_name(name)).then(|| name.to_owned())
}

/// Returns `NAME` of a path `.../NAME.binary` or `.../NAME.bsdf`, and otherwise the whole file name.
///
/// # Errors
/// If the file name is not UTF-8, or NAME is empty.
pub(super) fn name_of(path: &Path) -> Result<String, SourceError> {
    if let Some(name) = name_by_extension(path) {
        return Ok(name);
    }
    let name = path.file_name().and_then(|name| name.to_str());
    let name = name.ok_or_else(|| SourceError::UnknownFormat(path.into()))?;
    match EXTENSIONS.iter().any(|extension| name.ends_with(extension)) {
        false => Ok(name.to_owned()),
        true => Err(Defect::in_file(path)(Defect::Unsupported(
            "its file name has no name of a material".to_owned(),
            "rename it to NAME.binary, NAME_rgb.bsdf or NAME_spec.bsdf",
        ))),
    }
}

/// Returns true for a file `NAME_spec.bsdf` next to `NAME_rgb.bsdf`. RGL publishes each material in both forms.
pub(super) fn is_second_form(path: &Path) -> bool {
    let stem = name_by_extension(path).filter(|_| has_extension(path, "bsdf"));
    let stem = stem.as_deref().and_then(|name| name.strip_suffix(SPECTRA));
    stem.is_some_and(|stem| path.with_file_name(format!("{stem}{RGB}.bsdf")).is_file())
}

/// Returns true if a path has this extension.
pub(super) fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|other| other == extension)
}

/// Returns true if a material may have this name: it must be usable as a file name.
pub(super) fn is_valid_name(name: &str) -> bool {
    !name.trim().is_empty() && !name.contains(|c: char| c.is_control() || "/\\".contains(c))
}
