//! Output files. Each is written atomically, and no other file is replaced without `overwrite`.

use std::fs;
use std::path::{Path, PathBuf};

use glimpse_materials::files::write_atomic;
use pyo3::exceptions::{PyFileExistsError, PyFileNotFoundError, PyOSError};
use pyo3::prelude::*;

use crate::error::Result;

/// Writes files that belong together. If one of them exists with other bytes and `overwrite` is false, none is written.
pub(crate) fn write(files: &[(PathBuf, Vec<u8>)], overwrite: bool) -> Result<()> {
    for (path, bytes) in files {
        let differs = || !fs::read(path).is_ok_and(|present| present == *bytes);
        if !overwrite && path.is_file() && differs() {
            return Err(PyFileExistsError::new_err(format!(
                "{} exists: pass overwrite=True to replace it, or choose another path",
                path.display()
            ))
            .into());
        }
    }
    for (path, bytes) in files {
        write_atomic(path, bytes).map_err(|error| write_error(path, &error))?;
    }
    Ok(())
}

fn write_error(path: &Path, error: &std::io::Error) -> PyErr {
    let text = format!("cannot write {}: {error}", path.display());
    match error.kind() {
        std::io::ErrorKind::NotFound => PyFileNotFoundError::new_err(text),
        _ => PyOSError::new_err(text),
    }
}
