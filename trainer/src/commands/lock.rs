//! A lock on what a run writes, so that no other one writes it too.

use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use glimpse_materials::files::require_folder_of;

/// Held while a run lasts. Its file goes with it; of a run that was killed the file stays behind,
/// and is free.
#[derive(Debug)]
pub(super) struct Lock {
    path: PathBuf,
    /// Locked until it is closed.
    _file: Option<File>,
}

impl Lock {
    /// Locks what is written at `out`, by a file OUT.lock beside it.
    ///
    /// # Errors
    /// If another run holds it, or it cannot be made.
    pub(super) fn beside(out: &Path) -> anyhow::Result<Self> {
        let mut name = out.as_os_str().to_owned();
        name.push(".lock");
        Self::take(name.into(), out)
    }

    /// Locks a folder, by a file in it.
    ///
    /// # Errors
    /// As [`Lock::beside`].
    pub(super) fn within(folder: &Path) -> anyhow::Result<Self> {
        Self::take(folder.join("run.lock"), folder)
    }

    fn take(path: PathBuf, what: &Path) -> anyhow::Result<Self> {
        let cannot = || format!("cannot write {}", path.display());
        require_folder_of(&path).with_context(cannot)?;
        loop {
            let file = File::options().create(true).append(true).open(&path);
            let file = file.with_context(cannot)?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => bail!(
                    "another run is writing {}: it holds {}; wait until it ends, or give another \
                     --out",
                    what.display(),
                    path.display()
                ),
                Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => {
                    eprintln!(
                        "{} cannot be locked on this file system: see to it that no other run \
                         writes {}",
                        path.display(),
                        what.display()
                    );
                    return Ok(Self { path, _file: None });
                }
                Err(TryLockError::Error(error)) => return Err(error).with_context(cannot),
            }
            // The one who held it before may have removed it meanwhile: then this is the lock of
            // a file that nobody else finds any more.
            if is_at(&file, &path) {
                let _file = Some(file);
                return Ok(Self { path, _file });
            }
        }
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // While it is held, so that it is never another one's that is removed.
        let _ = fs::remove_file(&self.path);
    }
}

/// True if this open file is the one at a path.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;

    match (file.metadata(), fs::metadata(path)) {
        (Ok(open), Ok(found)) => (open.dev(), open.ino()) == (found.dev(), found.ino()),
        _ => false,
    }
}

/// An open file cannot be removed where this is compiled.
#[cfg(not(unix))]
fn is_at(_: &File, path: &Path) -> bool {
    path.exists()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_at_a_time_and_nothing_stays() {
        let scratch = tempfile::tempdir().unwrap();
        let out = scratch.path().join("a.recipe");
        let first = Lock::beside(&out).unwrap();
        let message = Lock::beside(&out).unwrap_err().to_string();
        assert!(message.contains("a.recipe.lock"), "{message}");
        Lock::beside(&scratch.path().join("b.recipe")).unwrap();
        drop(first);
        // A file that a killed run has left is free.
        fs::write(scratch.path().join("a.recipe.lock"), "").unwrap();
        drop(Lock::beside(&out).unwrap());
        drop(Lock::within(scratch.path()).unwrap());
        assert_eq!(fs::read_dir(scratch.path()).unwrap().count(), 0);
    }
}
