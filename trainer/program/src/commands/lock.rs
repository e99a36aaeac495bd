//! Lock files, so that no two runs write the same output.

use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, bail};
use glimpse_materials::files::require_parent_dir;

/// The files of all held locks.
static HELD: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// A lock that a run holds until it ends. Dropping it removes the lock file. A killed run leaves the file behind,
/// unlocked; so does any run on a file system without locks.
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
        let mut name = out.as_os_str().to_owned();
        name.push(".lock");
        Self::acquire(name.into(), out)
    }

    /// Locks an output folder, with the file `run.lock` in it.
    ///
    /// # Errors
    /// As [`Lock::of_path`].
    pub(super) fn of_folder(folder: &Path) -> anyhow::Result<Self> {
        Self::acquire(folder.join("run.lock"), folder)
    }

    fn new(path: PathBuf, file: File) -> Self {
        with_held(|held| held.push(path.clone()));
        Self {
            path,
            file: Some(file),
        }
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
                return Ok(Self::new(path, file));
            }
        }
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // The lock is still held here, so this never removes another run's file.
        if self.file.is_some() {
            let _ = fs::remove_file(&self.path);
            with_held(|held| held.retain(|path| *path != self.path));
        }
    }
}

fn with_held<T>(change: impl FnOnce(&mut Vec<PathBuf>) -> T) -> T {
    change(&mut HELD.lock().unwrap_or_else(PoisonError::into_inner))
}

/// Removes the files of all locks, for an exit of the program that drops nothing.
pub(super) fn remove_all() {
    for path in with_held(std::mem::take) {
        let _ = fs::remove_file(path);
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

    #[test]
    fn exit_leaves_no_lock_file() {
        let folder = tempfile::tempdir().expect("a temporary directory");
        let lock = Lock::of_folder(folder.path()).expect("a lock");
        let path = folder.path().join("run.lock");
        assert!(path.exists());
        remove_all();
        assert!(!path.exists());
        drop(lock);
        Lock::of_folder(folder.path()).expect("a lock");
        assert!(!path.exists() && with_held(|held| held.is_empty()));
    }

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
