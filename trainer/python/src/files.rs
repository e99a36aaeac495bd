//! Files that Python asks for: whole or not at all, and never over another one without a word.

use std::fs;
use std::path::{Path, PathBuf};

use glimpse_materials::files::write_whole;
use pyo3::exceptions::{PyFileExistsError, PyFileNotFoundError, PyOSError};
use pyo3::prelude::*;

/// Writes files that belong together; none of them if one is there, is not the same, and must stay.
pub(crate) fn write(files: &[(PathBuf, Vec<u8>)], overwrite: bool) -> PyResult<()> {
    for (path, bytes) in files {
        let differs = || !fs::read(path).is_ok_and(|old| old == *bytes);
        if !overwrite && path.is_file() && differs() {
            return Err(PyFileExistsError::new_err(format!(
                "{} is there: give overwrite=True to replace it, or another path",
                path.display()
            )));
        }
    }
    files.iter().try_for_each(|(path, bytes)| {
        write_whole(path, bytes).map_err(|error| cannot(path, &error))
    })
}

fn cannot(path: &Path, error: &std::io::Error) -> PyErr {
    let text = format!("cannot write {}: {error}", path.display());
    match error.kind() {
        std::io::ErrorKind::NotFound => PyFileNotFoundError::new_err(text),
        _ => PyOSError::new_err(text),
    }
}
