//! Entries of a directory that look like materials and are not read.

use std::fmt;
use std::path::Path;

use crate::error::entries;
use crate::name::{is_second_form, name_by_extension};
use crate::{FittedMaterial, NeuralBrdf, SourceError};

/// Endings of material files, in lowercase.
const ENDINGS: [&str; 5] = [".binary", ".bsdf", ".npy", ".ssdd", ".xompt"];
/// The largest number of names in a message.
const MAX_NAMES: usize = 10;

/// The sorted names of entries that are not read: directories without the `material.json` of a fit, and files with a
/// material's extension whose names are not UTF-8, have capital letters in the extension, or do not fit the format, and
/// `NAME_spec.bsdf` next to `NAME_rgb.bsdf`. Other kinds of files, such as a README, are not listed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SkippedEntries(pub Vec<String>);

impl SkippedEntries {
    /// Lists the skipped entries of a directory.
    pub(super) fn scan(directory: &Path) -> Result<Self, SourceError> {
        let mut names = Vec::new();
        for path in entries(directory)? {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let lowercase = name.to_lowercase();
            let is_skipped = match path.is_dir() {
                true => FittedMaterial::find_in(&path).is_none(),
                false => {
                    let is_read = NeuralBrdf::name_of(&path)
                        .or(name_by_extension(&path))
                        .is_some();
                    is_second_form(&path)
                        || !is_read && ENDINGS.iter().any(|ending| lowercase.ends_with(ending))
                }
            };
            if is_skipped {
                names.push(name.into_owned());
            }
        }
        names.sort();
        Ok(Self(names))
    }
}

impl fmt::Display for SkippedEntries {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let count = self.0.len();
        let ellipsis = if count > MAX_NAMES { ", ..." } else { "" };
        let names = self.0[..count.min(MAX_NAMES)].join(", ");
        write!(
            f,
            "{count} entries ({names}{ellipsis}); a directory needs a material.json, and a file the UTF-8 name \
             NAME.binary, NAME.bsdf, NAME.ssdd, NAME_brdf.xompt or NAME_fc1.npy; NAME_rgb.bsdf is read instead of NAME_spec.bsdf"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_skipped_entries() {
        let scratch = tempfile::tempdir().unwrap();
        let path_of = |name: &str| scratch.path().join(name);
        for name in ["README.md", "a.binary", "a_fc1.npy", "no-extension"] {
            std::fs::write(path_of(name), "").unwrap();
        }
        let scan = || SkippedEntries::scan(scratch.path()).unwrap();
        assert_eq!(scan(), SkippedEntries::default());
        for name in ["B.BSDF", "c.Binary", "mean.npy", ".bsdf"] {
            std::fs::write(path_of(name), "").unwrap();
        }
        #[cfg(target_os = "linux")]
        for name in [&b"gr\xfcn.binary"[..], b"gr\xfcn.txt"] {
            use std::os::unix::ffi::OsStrExt;
            std::fs::write(scratch.path().join(std::ffi::OsStr::from_bytes(name)), "").unwrap();
        }
        std::fs::create_dir(path_of("s.binary")).unwrap();
        let mut expected = vec![".bsdf", "B.BSDF", "c.Binary"];
        #[cfg(target_os = "linux")]
        expected.push("gr\u{fffd}n.binary");
        expected.extend(["mean.npy", "s.binary"]);
        assert_eq!(scan().0, expected);
        let text = scan().to_string();
        assert!(expected.iter().all(|name| text.contains(name)), "{text}");
    }
}
