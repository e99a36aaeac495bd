//! What a directory of materials holds and is not read, though somebody may have meant it to be.

use std::ffi::OsStr;
use std::fmt;
use std::path::Path;

use crate::error::refused;
use crate::name::name_by_ending;
use crate::{FittedMaterial, NeuralBrdf, SourceError};

/// How the names of materials' files end.
const ENDINGS: [&str; 3] = ["binary", "bsdf", "npy"];
/// How many names are shown.
const SHOWN: usize = 3;

/// What is not read of a directory. Files of other kinds, such as a README, are none of it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SkippedEntries {
    /// Directories within it: they are not entered, but for the `material.json` of a fit.
    pub directories: Vec<String>,
    /// Files whose names are no UTF-8, as far as they can be shown.
    pub not_utf8: Vec<String>,
    /// Files whose names end like a material's but for capital letters.
    pub capitals: Vec<String>,
    /// Files whose names end like a material's, and which are none: arrays that are not one of a
    /// network's six, or nothing before the ending.
    pub unnamed: Vec<String>,
}

impl SkippedEntries {
    /// Looks at a directory's names.
    pub(super) fn scan(directory: &Path) -> Result<Self, SourceError> {
        let mut all = Self::default();
        for entry in directory.read_dir().map_err(refused(directory))? {
            let path = entry.map_err(refused(directory))?.path();
            let name = path.file_name().unwrap_or_default();
            let shown = name.to_string_lossy().into_owned();
            if path.is_dir() {
                if FittedMaterial::within(&path).is_none() {
                    all.directories.push(shown);
                }
                continue;
            }
            let ending = ending(name);
            let known = ENDINGS
                .iter()
                .find(|known| known.eq_ignore_ascii_case(&ending));
            let Some(known) = known else {
                continue;
            };
            if name.to_str().is_none() {
                all.not_utf8.push(shown);
            } else if ending != *known {
                all.capitals.push(shown);
            } else if NeuralBrdf::name_of(&path).is_none() && name_by_ending(&path).is_none() {
                all.unnamed.push(shown);
            }
        }
        for list in [
            &mut all.directories,
            &mut all.not_utf8,
            &mut all.capitals,
            &mut all.unnamed,
        ] {
            list.sort();
        }
        Ok(all)
    }

    /// True if nothing is.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// What follows the last dot of a name; that need not be UTF-8.
fn ending(name: &OsStr) -> String {
    let name = name.to_string_lossy();
    let ending = name.rsplit_once('.').map(|(_, ending)| ending);
    ending.unwrap_or_default().to_owned()
}

/// In words, each kind with its reason.
impl fmt::Display for SkippedEntries {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut joint = "";
        for (names, one, many, why) in [
            (&self.directories, "folder", "folders", "not entered"),
            (&self.not_utf8, "file", "files", "a name must be UTF-8"),
            (
                &self.capitals,
                "file",
                "files",
                "endings must be small letters",
            ),
            (
                &self.unnamed,
                "file",
                "files",
                "not the name of a material's file",
            ),
        ] {
            let noun = match names.len() {
                0 => continue,
                1 => one,
                _ => many,
            };
            let shown = names.iter().take(SHOWN);
            let shown: Vec<&str> = shown.map(String::as_str).collect();
            let more = if names.len() > SHOWN { ", ..." } else { "" };
            let (count, shown) = (names.len(), shown.join(", "));
            write!(f, "{joint}{count} {noun} ({shown}{more}: {why})")?;
            joint = ", ";
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_may_have_been_meant_is_told_and_nothing_else() {
        let scratch = tempfile::tempdir().unwrap();
        let at = |name: &str| scratch.path().join(name);
        for name in ["README.md", "a.binary", "a_fc1.npy", "no-ending"] {
            std::fs::write(at(name), "").unwrap();
        }
        let found = || SkippedEntries::scan(scratch.path()).unwrap();
        assert!(found().is_empty());
        assert_eq!(found().to_string(), "");
        for name in ["B.BSDF", "c.Binary", "mean.npy", ".bsdf"] {
            std::fs::write(at(name), "").unwrap();
        }
        for name in ["s1", "s2", "s3", "s4.binary"] {
            std::fs::create_dir(at(name)).unwrap();
        }
        let expected = SkippedEntries {
            directories: ["s1", "s2", "s3", "s4.binary"].map(str::to_owned).into(),
            not_utf8: Vec::new(),
            capitals: ["B.BSDF", "c.Binary"].map(str::to_owned).into(),
            unnamed: [".bsdf", "mean.npy"].map(str::to_owned).into(),
        };
        assert_eq!(found(), expected);
        // No more names than a line holds.
        let text = found().to_string();
        for name in ["s1", "s2", "s3", "B.BSDF", "c.Binary", ".bsdf", "mean.npy"] {
            assert!(text.contains(name), "no {name} in {text}");
        }
        assert!(!text.contains("s4.binary"), "{text}");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn names_that_are_no_utf8_are_told() {
        use std::os::unix::ffi::OsStrExt;

        let scratch = tempfile::tempdir().unwrap();
        for name in [&b"gr\xfcn.binary"[..], b"gr\xfcn.txt"] {
            std::fs::write(scratch.path().join(OsStr::from_bytes(name)), "").unwrap();
        }
        let found = SkippedEntries::scan(scratch.path()).unwrap();
        let expected = SkippedEntries {
            not_utf8: vec!["gr\u{fffd}n.binary".to_owned()],
            ..SkippedEntries::default()
        };
        assert_eq!(found, expected);
        assert!(found.to_string().contains("gr\u{fffd}n.binary"), "{found}");
    }
}
