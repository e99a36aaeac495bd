//! A temporary directory of material files, and helpers to read them.

use std::fs;
use std::path::{Path, PathBuf};

use glimpse_materials::{Material, NeuralBrdf, Source, SourceError, to_merl, to_nbrdf};
use tempfile::TempDir;

use crate::common::assert_names;

/// A temporary directory.
pub(crate) struct Folder(TempDir);

impl Folder {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary directory is created"))
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

    /// Tabulates a material and writes the table.
    pub(crate) fn write_table(&self, name: &str, material: &dyn Material) -> PathBuf {
        self.write(name, to_merl(material).expect("the BRDF is finite"))
    }

    /// Writes a network's six files with the code under test.
    pub(crate) fn write_network(&self, name: &str, network: &NeuralBrdf) {
        for (suffix, bytes) in to_nbrdf(network.parameters()) {
            self.write(&format!("{name}{suffix}"), bytes);
        }
    }
}

/// Reads the materials of a source.
pub(crate) fn load(path: &Path) -> Result<Vec<Box<dyn Material>>, SourceError> {
    Source(path.display().to_string()).load()
}

/// Asserts that reading a file reports a defect, and that the message contains the given words.
pub(crate) fn assert_defect<T>(read: Result<T, SourceError>, file: &Path, words: &[&str]) {
    let defect = reported_defect(read, file);
    let defect = defect.unwrap_or_else(|| panic!("the damaged file is read: {words:?}"));
    assert_names(&defect, words);
}

/// Returns the reported defect of a damaged or unsupported file, or None if the file can be read.
pub(crate) fn reported_defect<T>(read: Result<T, SourceError>, file: &Path) -> Option<String> {
    match read.err()? {
        SourceError::Damaged { path, defect } => {
            assert_eq!(path, file);
            Some(defect)
        }
        SourceError::Unsupported {
            path,
            defect,
            remedy,
        } => {
            assert_eq!(path, file);
            Some(format!("{defect}; {remedy}"))
        }
        error => panic!("{error}"),
    }
}
