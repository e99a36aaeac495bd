//! A temporary folder of files of materials, and what reading them comes to.

use std::fs;
use std::path::{Path, PathBuf};

use glimpse_materials::{Material, NeuralBrdf, Source, SourceError, to_nbrdf};
use tempfile::TempDir;

/// A temporary folder, in which files have names.
pub(crate) struct Folder(TempDir);

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

    /// Writes a file; returns its path.
    pub(crate) fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        fs::write(self.at(name), bytes).expect("it is written");
        self.at(name)
    }

    /// Writes a network's six files as the code under test does.
    pub(crate) fn write_network(&self, name: &str, network: &NeuralBrdf) {
        for (ending, bytes) in to_nbrdf(network.parameters()) {
            self.write(&format!("{name}{ending}"), bytes);
        }
    }
}

/// The materials of a source.
pub(crate) fn load(path: &Path) -> Result<Vec<Box<dyn Material>>, SourceError> {
    Source(path.display().to_string()).load()
}

/// The message about a file that is damaged, which names it; None if it is read.
pub(crate) fn damage<T>(read: Result<T, SourceError>, file: &Path) -> Option<String> {
    match read.err()? {
        SourceError::Damaged { path, what } => {
            assert_eq!(path, file);
            Some(what)
        }
        error => panic!("{error}"),
    }
}
