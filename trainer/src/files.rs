//! Files written whole or not at all.

use std::fs;
use std::io::{self, Write as _};
use std::path::Path;

use tempfile::NamedTempFile;

/// Writes a file so that, whatever happens, a reader finds the old content or all of the new.
///
/// The bytes go to a temporary file in the same directory, which then takes the name. Directories
/// on the way are made; permissions are those of any new file. What writes of the same file that
/// were killed have left there is removed.
///
/// # Errors
/// If the operating system refuses; nothing is left behind then.
pub fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let directory = directory_of(path);
    fs::create_dir_all(directory)?;
    remove_unfinished(path)?;
    let mut file = unfinished(path)?;
    file.write_all(bytes)?;
    file.as_file().sync_all()?;
    file.persist(path)?;
    Ok(())
}

/// Makes sure, before hours are spent, that a file of so many bytes could be written: tries it
/// under another name, and leaves nothing but directories on the way.
///
/// # Errors
/// If it could not.
pub fn try_write(path: &Path, bytes: usize) -> io::Result<()> {
    if path.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    fs::create_dir_all(directory_of(path))?;
    let mut file = unfinished(path)?;
    file.write_all(&vec![0xa5; bytes])?;
    file.as_file().sync_all()
}

fn directory_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// How names of temporary files begin.
fn prefix(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    format!(".unfinished-{name}-")
}

/// A temporary file beside `path`; gone when dropped.
fn unfinished(path: &Path) -> io::Result<NamedTempFile> {
    let prefix = prefix(path);
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix);
    // Temporary files are private; this one is about to become an ordinary file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(directory_of(path))
}

/// Removes the temporary files of `path` that killed writes have left.
fn remove_unfinished(path: &Path) -> io::Result<()> {
    let prefix = prefix(path);
    for entry in fs::read_dir(directory_of(path))? {
        let entry = entry?;
        if entry.file_name().to_string_lossy().starts_with(&prefix) {
            fs::remove_file(entry.path())?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_and_nothing_else_is_left() {
        let scratch = tempfile::tempdir().unwrap();
        let path = scratch.path().join("deep/er/file");
        write_whole(&path, b"one").unwrap();
        write_whole(&path, b"two").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"two");
        let beside = std::fs::read_dir(path.parent().unwrap()).unwrap();
        assert_eq!(beside.count(), 1);
    }

    #[test]
    fn what_a_killed_write_left_is_removed_by_the_next() {
        let scratch = tempfile::tempdir().unwrap();
        let path = scratch.path().join("file");
        let (_, left) = unfinished(&path).unwrap().keep().unwrap();
        let (_, other) = unfinished(&scratch.path().join("other"))
            .unwrap()
            .keep()
            .unwrap();
        write_whole(&path, b"one").unwrap();
        assert!(!left.exists());
        assert!(other.exists());
    }

    #[test]
    fn a_try_leaves_nothing_behind() {
        let scratch = tempfile::tempdir().unwrap();
        try_write(&scratch.path().join("file"), 100).unwrap();
        assert_eq!(std::fs::read_dir(scratch.path()).unwrap().count(), 0);
        assert!(try_write(scratch.path(), 100).is_err());
    }

    #[test]
    fn a_refusal_leaves_nothing_behind() {
        let scratch = tempfile::tempdir().unwrap();
        let directory = scratch.path().join("taken");
        std::fs::create_dir_all(directory.join("inside")).unwrap();
        assert!(write_whole(&directory, b"one").is_err());
        assert_eq!(std::fs::read_dir(scratch.path()).unwrap().count(), 1);
    }
}
