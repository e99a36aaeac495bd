//! A temporary directory of material files, and helpers to read them.

use std::path::{Path, PathBuf};

use glimpse_materials::{Format, Material, NeuralBrdf, Source, SourceError, to_merl, to_nbrdf};

pub(crate) use crate::common::Folder;
use crate::common::assert_names;

impl Folder {
    /// Tabulates a material and writes the table.
    pub(crate) fn write_table(&self, name: &str, material: &dyn Material) -> PathBuf {
        self.write(name, to_merl(material).expect("the BRDF is finite"))
    }

    /// Writes a network's six files with the code under test.
    pub(crate) fn write_network(&self, name: &str, network: &NeuralBrdf) {
        let endings = Format::Nbrdf.properties().written.iter();
        for (ending, bytes) in endings.zip(to_nbrdf(network.parameters())) {
            self.write(&format!("{name}{ending}"), bytes);
        }
    }
}

/// Reads the materials of a source.
pub(crate) fn load(path: &Path) -> Result<Vec<Box<dyn Material>>, SourceError> {
    Source(path.display().to_string()).load()
}

/// Asserts that a source is rejected because of a file, and that the message contains each of `words`, which are
/// separated by spaces.
pub(crate) fn assert_defect(source: &Path, file: &Path, words: &str) {
    let defect = reported_defect(source, file);
    let defect = defect.unwrap_or_else(|| panic!("the damaged file is read: {words:?}"));
    assert_names(&defect, &words.split_whitespace().collect::<Vec<_>>());
}

/// Returns the reported defect of a damaged or unsupported file, or None if the source can be read.
pub(crate) fn reported_defect(source: &Path, file: &Path) -> Option<String> {
    // Incomplete sets are read as they are, because resampling takes seconds.
    let source = Source(source.display().to_string());
    let defect = match source.load_measured().err()? {
        SourceError::Rejected { path, defect } if path == file => defect.to_string(),
        SourceError::UnknownFormat { path, start } if path == file => start,
        error => panic!("{error}"),
    };
    assert!(!defect.contains(char::is_control), "{defect:?}");
    assert!(defect.len() < 500, "{} bytes: {defect}", defect.len());
    Some(defect)
}
