//! Lock files, so that no two runs write the same output.

use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use glimpse_materials::files::require_parent_dir;

use crate::output::create_out_folder;

/// A lock that a run holds until it ends. Dropping it removes the lock file. A killed run, or one that
/// a second Ctrl-C ended, leaves the file behind, unlocked; so does any run on a file system without locks.
#[derive(Debug)]
pub(super) struct Lock {
    path: PathBuf,
    /// The lock file, locked until it is closed; None if the file system has no locks.
    file: Option<File>,
}

impl Lock {
    /// Locks the output path `out`, with the file `OUT.lock` next to it.
    ///
    /// # Errors
    /// If another run holds the lock, or the lock file cannot be created.
    pub(super) fn of_path(out: &Path) -> anyhow::Result<Self> {
        Self::acquire(out.with_added_extension("lock"), out)
    }

    /// Creates an output folder unless it exists, and locks it with the file `run.lock` in it. Its parent folder must exist.
    ///
    /// # Errors
    /// As [`Lock::of_path`].
    pub(super) fn of_folder(folder: &Path) -> anyhow::Result<Self> {
        create_out_folder(folder)?;
        Self::acquire(folder.join("run.lock"), folder)
    }

    fn acquire(path: PathBuf, output: &Path) -> anyhow::Result<Self> {
        let context = || format!("cannot write {}", path.display());
        require_parent_dir(&path).with_context(context)?;
        loop {
            let file = File::options().create(true).append(true).open(&path);
            let file = file.with_context(context)?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => bail!(
                    "another run is writing {}, and holds the lock {}: wait until it ends, or give \
                     another --out",
                    output.display(),
                    path.display()
                ),
                Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => {
                    eprintln!(
                        "warning: cannot lock {} on this file system: make sure that no other run \
                         writes {}",
                        path.display(),
                        output.display()
                    );
                    return Ok(Self { path, file: None });
                }
                Err(TryLockError::Error(error)) => return Err(error).with_context(context),
            }
            // The previous holder may have removed the file between open and lock. Then the lock is
            // worthless, since other runs create a new file.
            if is_at(&file, &path) {
                let file = Some(file);
                return Ok(Self { path, file });
            }
        }
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // The lock is still held here, so this never removes another run's file.
        if self.file.is_some() {
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Returns true if this open file is the one at a path.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;

    match (file.metadata(), fs::metadata(path)) {
        (Ok(open), Ok(current)) => (open.dev(), open.ino()) == (current.dev(), current.ino()),
        _ => false,
    }
}

/// Returns true if the path exists. Systems other than Unix do not remove an open file.
#[cfg(not(unix))]
fn is_at(_: &File, path: &Path) -> bool {
    path.exists()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Without locks, the file may be that of another run.
    #[test]
    fn file_remains_on_file_systems_without_locks() {
        let folder = tempfile::tempdir().expect("a temporary directory");
        let path = folder.path().join("run.lock");
        File::create(&path).expect("the file is created");
        drop(Lock {
            path: path.clone(),
            file: None,
        });
        assert!(path.exists());
    }
}
