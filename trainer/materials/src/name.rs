//! Names of materials, derived from file names.

use std::path::Path;

use crate::SourceError;

/// Extensions of files that hold one material each.
const EXTENSIONS: [&str; 2] = [".binary", ".bsdf"];

/// Returns `NAME` of a path `.../NAME.binary` or `.../NAME.bsdf`, or None for any other path.
pub(super) fn name_by_extension(path: &Path) -> Option<String> {
    let name = path.file_name()?.to_str()?;
    let name = EXTENSIONS
        .iter()
        .find_map(|extension| name.strip_suffix(extension))?;
    (!name.is_empty()).then(|| name.to_owned())
}

/// Returns `NAME` of a path `.../NAME.binary` or `.../NAME.bsdf`, and otherwise the whole file name.
///
/// # Errors
/// If the file name is not UTF-8.
pub(super) fn name_of(path: &Path) -> Result<String, SourceError> {
    name_by_extension(path)
        .or_else(|| Some(path.file_name()?.to_str()?.to_owned()))
        .ok_or_else(|| SourceError::UnknownFormat(path.into()))
}

/// Returns true if a material may have this name: it must be usable as a file name.
pub(super) fn is_valid_name(name: &str) -> bool {
    !name.is_empty() && !name.contains(|c: char| c.is_control() || "/\\".contains(c))
}
