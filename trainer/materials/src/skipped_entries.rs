//! Entries of a directory that look like materials and are not read.

use std::ffi::OsStr;
use std::fmt;
use std::path::Path;

use crate::error::read_error;
use crate::name::name_by_extension;
use crate::{FittedMaterial, NeuralBrdf, SourceError};

/// Extensions of material files.
const EXTENSIONS: [&str; 3] = ["binary", "bsdf", "npy"];
/// The largest number of names that a message lists for each kind.
const MAX_NAMES: usize = 3;

/// Entries of a directory that are not read. Other kinds of files, such as a README, are not listed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SkippedEntries {
    /// Subdirectories without the `material.json` of a fit. They are not searched.
    pub directories: Vec<String>,
    /// Files with non-UTF-8 names, converted lossily.
    pub not_utf8: Vec<String>,
    /// Files with a material's extension that has capital letters.
    pub uppercase: Vec<String>,
    /// Files with a material's extension whose names do not fit its format: arrays that are not one of a network's six,
    /// or names without a stem.
    pub unrecognized: Vec<String>,
}

impl SkippedEntries {
    /// Lists the skipped entries of a directory.
    pub(super) fn scan(directory: &Path) -> Result<Self, SourceError> {
        let mut skipped = Self::default();
        for entry in directory.read_dir().map_err(read_error(directory))? {
            let path = entry.map_err(read_error(directory))?.path();
            let name = path.file_name().unwrap_or_default();
            let text = name.to_string_lossy().into_owned();
            if path.is_dir() {
                if FittedMaterial::find_in(&path).is_none() {
                    skipped.directories.push(text);
                }
                continue;
            }
            let extension = extension(name);
            let lowercase = EXTENSIONS
                .iter()
                .find(|lowercase| lowercase.eq_ignore_ascii_case(&extension));
            let Some(lowercase) = lowercase else {
                continue;
            };
            if name.to_str().is_none() {
                skipped.not_utf8.push(text);
            } else if extension != *lowercase {
                skipped.uppercase.push(text);
            } else if NeuralBrdf::name_of(&path).is_none() && name_by_extension(&path).is_none() {
                skipped.unrecognized.push(text);
            }
        }
        for list in [
            &mut skipped.directories,
            &mut skipped.not_utf8,
            &mut skipped.uppercase,
            &mut skipped.unrecognized,
        ] {
            list.sort();
        }
        Ok(skipped)
    }

    /// Returns true if no entries are skipped.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// Returns the text after the last dot of a name. Bytes that are not UTF-8 are replaced.
fn extension(name: &OsStr) -> String {
    let name = name.to_string_lossy();
    let extension = name.rsplit_once('.').map(|(_, extension)| extension);
    extension.unwrap_or_default().to_owned()
}

impl fmt::Display for SkippedEntries {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut separator = "";
        for (names, singular, plural, reason) in [
            (
                &self.directories,
                "directory",
                "directories",
                "not searched",
            ),
            (&self.not_utf8, "file", "files", "the name must be UTF-8"),
            (
                &self.uppercase,
                "file",
                "files",
                "the extension must be lowercase",
            ),
            (
                &self.unrecognized,
                "file",
                "files",
                "not the name of a material file",
            ),
        ] {
            let noun = match names.len() {
                0 => continue,
                1 => singular,
                _ => plural,
            };
            let first_names: Vec<&str> = names.iter().take(MAX_NAMES).map(String::as_str).collect();
            let first_names = first_names.join(", ");
            let ellipsis = if names.len() > MAX_NAMES { ", ..." } else { "" };
            let count = names.len();
            write!(
                f,
                "{separator}{count} {noun} ({first_names}{ellipsis}: {reason})"
            )?;
            separator = ", ";
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_skipped_entries_by_kind() {
        let scratch = tempfile::tempdir().unwrap();
        let path_of = |name: &str| scratch.path().join(name);
        for name in ["README.md", "a.binary", "a_fc1.npy", "no-extension"] {
            std::fs::write(path_of(name), "").unwrap();
        }
        let scan = || SkippedEntries::scan(scratch.path()).unwrap();
        assert!(scan().is_empty());
        assert_eq!(scan().to_string(), "");
        for name in ["B.BSDF", "c.Binary", "mean.npy", ".bsdf"] {
            std::fs::write(path_of(name), "").unwrap();
        }
        for name in ["s1", "s2", "s3", "s4.binary"] {
            std::fs::create_dir(path_of(name)).unwrap();
        }
        let expected = SkippedEntries {
            directories: ["s1", "s2", "s3", "s4.binary"].map(str::to_owned).into(),
            not_utf8: Vec::new(),
            uppercase: ["B.BSDF", "c.Binary"].map(str::to_owned).into(),
            unrecognized: [".bsdf", "mean.npy"].map(str::to_owned).into(),
        };
        assert_eq!(scan(), expected);
        // The fourth directory exceeds `MAX_NAMES`.
        let text = scan().to_string();
        for name in ["s1", "s2", "s3", "B.BSDF", "c.Binary", ".bsdf", "mean.npy"] {
            assert!(text.contains(name), "no {name} in {text}");
        }
        assert!(!text.contains("s4.binary"), "{text}");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn lists_non_utf8_names() {
        use std::os::unix::ffi::OsStrExt;

        let scratch = tempfile::tempdir().unwrap();
        for name in [&b"gr\xfcn.binary"[..], b"gr\xfcn.txt"] {
            std::fs::write(scratch.path().join(OsStr::from_bytes(name)), "").unwrap();
        }
        let skipped = SkippedEntries::scan(scratch.path()).unwrap();
        let expected = SkippedEntries {
            not_utf8: vec!["gr\u{fffd}n.binary".to_owned()],
            ..SkippedEntries::default()
        };
        assert_eq!(skipped, expected);
        assert!(
            skipped.to_string().contains("gr\u{fffd}n.binary"),
            "{skipped}"
        );
    }
}
