//! Output files. Each is written atomically, and no other file is replaced without `overwrite`.

use std::io::{Error, ErrorKind};
use std::path::PathBuf;

use glimpse_materials::files::{has_content, write_atomic};
use pyo3::prelude::*;

use crate::error::Result;

/// Writes files that belong together. If one of them exists with other bytes and `overwrite` is false, none is written.
pub(crate) fn write(files: &[(PathBuf, Vec<u8>)], overwrite: bool) -> Result<()> {
    for (path, bytes) in files {
        if !overwrite && path.is_file() && !has_content(path, bytes) {
            let message = format!(
                "{} exists: pass overwrite=True to replace it, or choose another path",
                path.display()
            );
            return Err(PyErr::from(Error::new(ErrorKind::AlreadyExists, message)).into());
        }
    }
    for (path, bytes) in files {
        write_atomic(path, bytes).map_err(|error| {
            let message = format!("cannot write {}: {error}", path.display());
            PyErr::from(Error::new(error.kind(), message))
        })?;
    }
    Ok(())
}
