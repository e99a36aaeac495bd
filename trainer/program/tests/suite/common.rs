//! Temporary folders, and checks of messages that do not depend on their wording. Tests of two crates share them.

use std::fs;
use std::path::{Path, PathBuf};

/// A temporary folder. File names are relative to it.
pub(crate) struct Folder(tempfile::TempDir);

impl Folder {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary directory"))
    }

    pub(crate) fn path(&self) -> &Path {
        self.0.path()
    }

    pub(crate) fn at(&self, name: &str) -> PathBuf {
        self.path().join(name)
    }

    /// Writes a file and returns its path.
    pub(crate) fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        fs::write(self.at(name), bytes).expect("the file is written");
        self.at(name)
    }
}

/// Asserts that a message contains options, files, columns or numbers, each as a separate word.
pub(crate) fn assert_names(message: &str, identifiers: &[&str]) {
    let is_word = |letter: Option<char>| letter.is_some_and(|c| c.is_alphanumeric() || c == '_');
    for identifier in identifiers {
        let (first, last) = (identifier.chars().next(), identifier.chars().next_back());
        let is_present = message.match_indices(identifier).any(|(start, _)| {
            let (before, behind) = (&message[..start], &message[start + identifier.len()..]);
            let joined_before = is_word(before.chars().next_back()) && is_word(first);
            let joined_behind = is_word(behind.chars().next()) && is_word(last);
            !joined_before && !joined_behind
        });
        assert!(is_present, "no {identifier} in {message}");
    }
}
