//! What a material in one file is called.

use std::path::Path;

/// Endings of files with one material each.
const ENDINGS: [&str; 2] = [".binary", ".bsdf"];

/// `NAME` of a path `.../NAME.binary` or `.../NAME.bsdf`; None for any other.
pub(super) fn name_by_ending(path: &Path) -> Option<String> {
    let name = path.file_name()?.to_str()?;
    let name = ENDINGS
        .iter()
        .find_map(|ending| name.strip_suffix(ending))?;
    (!name.is_empty()).then(|| name.to_owned())
}

/// The same, and of any other path the whole name of the file; None if it is no UTF-8.
pub(super) fn name_of(path: &Path) -> Option<String> {
    let whole = || Some(path.file_name()?.to_str()?.to_owned());
    name_by_ending(path).or_else(whole)
}

/// True of what a file may call its material: files may be named by it.
pub(super) fn is_name(name: &str) -> bool {
    !name.is_empty() && !name.contains(|c: char| c.is_control() || "/\\".contains(c))
}
