//! Files written whole or not at all.

use std::io::{self, Write as _};
use std::path::Path;

/// Writes a file so that, whatever happens, a reader finds the old content or all of the new.
///
/// The bytes go to a temporary file in the same directory, which then takes the name. Directories
/// on the way are made; permissions are those of any new file.
///
/// # Errors
/// If the operating system refuses; nothing is left behind then.
pub fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let directory = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    std::fs::create_dir_all(directory)?;
    let mut builder = tempfile::Builder::new();
    builder.prefix(".unfinished-");
    // Temporary files are private; this one is about to become an ordinary file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut file = builder.tempfile_in(directory)?;
    file.write_all(bytes)?;
    file.as_file().sync_all()?;
    file.persist(path)?;
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
    fn a_refusal_leaves_nothing_behind() {
        let scratch = tempfile::tempdir().unwrap();
        let directory = scratch.path().join("taken");
        std::fs::create_dir_all(directory.join("inside")).unwrap();
        assert!(write_whole(&directory, b"one").is_err());
        assert_eq!(std::fs::read_dir(scratch.path()).unwrap().count(), 1);
    }
}
