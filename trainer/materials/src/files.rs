//! Atomic writes of files, and writes to pipes and devices.

use std::fs::{self, OpenOptions};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

/// The first letters of the names of temporary files.
const UNFINISHED: &str = ".unfinished-";

/// Writes a file atomically: a reader sees either the complete old content or the complete new content.
///
/// The bytes go to a temporary file in the same directory, which then takes the name and the permissions of the old
/// file. A symbolic link to a file is kept, and its target is written. A pipe or a device is written to directly.
///
/// # Errors
/// If the operating system cannot write the file, the file is read-only, or its directory does not exist. The temporary
/// file is then removed; only a killed process leaves it, and [`is_unfinished`] finds it.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let Some(path) = replaced_file(path)? else {
        return OpenOptions::new().append(true).open(path)?.write_all(bytes);
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(UNFINISHED);
    // By default, only the owner can read a temporary file. This one becomes an ordinary file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut file = builder.tempfile_in(directory_of(&path))?;
    if let Ok(old) = fs::metadata(&path) {
        file.as_file().set_permissions(old.permissions())?;
    }
    file.write_all(bytes)?;
    file.as_file().sync_all()?;
    file.persist(&path)?;
    Ok(())
}

/// Returns true for the temporary file of a [`write_atomic`].
#[must_use]
pub fn is_unfinished(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default();
    name.to_string_lossy().starts_with(UNFINISHED)
}

/// Checks that a file can be created or replaced, before a long computation. Pipes and devices are not checked.
///
/// # Errors
/// If the file cannot be written.
pub fn check_writable(path: &Path) -> io::Result<()> {
    // Unless the file system lacks it, this file has no name.
    let file = replaced_file(path)?.map(|path| tempfile::tempfile_in(directory_of(&path)));
    file.transpose().map(drop)
}

/// Creates a directory unless it exists. Its parent must exist.
///
/// # Errors
/// If it cannot be created. The kind is [`io::ErrorKind::NotADirectory`] if a file has this path.
pub fn ensure_dir(path: &Path) -> io::Result<()> {
    require_parent_dir(path)?;
    match fs::create_dir(path) {
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => require_dir(path),
        result => result,
    }
}

/// Checks that the directory of a file exists.
///
/// # Errors
/// If the directory does not exist. The kind is [`io::ErrorKind::NotADirectory`] if a file has its path.
pub fn require_parent_dir(path: &Path) -> io::Result<()> {
    require_dir(directory_of(path))
}

fn require_dir(path: &Path) -> io::Result<()> {
    let error = match fs::metadata(path) {
        Ok(metadata) if metadata.is_dir() => return Ok(()),
        Ok(_) => io::ErrorKind::NotADirectory.into(),
        Err(error) => error,
    };
    let message = format!(
        "{} is not a directory ({error}); create it first, or give another path",
        path.display()
    );
    Err(io::Error::new(error.kind(), message))
}

/// Returns true if a file holds exactly these bytes.
#[must_use]
pub fn has_content(path: &Path, bytes: &[u8]) -> bool {
    path.is_file() && fs::read(path).is_ok_and(|content| content == bytes)
}

/// Returns true if a path is a pipe, a device or a socket, which is written to and never replaced.
#[must_use]
pub fn is_stream(path: &Path) -> bool {
    matches!(replaced_file(path), Ok(None))
}

/// Returns the path of the file that a write creates or replaces, without symbolic links. Returns None for a pipe, a
/// device or a socket.
fn replaced_file(path: &Path) -> io::Result<Option<PathBuf>> {
    let Ok(metadata) = fs::metadata(path) else {
        require_parent_dir(path)?;
        return Ok(Some(path.to_owned()));
    };
    if metadata.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    // `/dev/stdout` may lead to a regular file that the shell has already opened.
    let stream_paths = ["/dev/stdout", "/dev/stderr", "/dev/fd", "/proc"];
    if !metadata.is_file() || stream_paths.iter().any(|prefix| path.starts_with(prefix)) {
        return Ok(None);
    }
    if metadata.permissions().readonly() {
        let message = "the file is read-only; make it writable, or write to another path";
        return Err(io::Error::new(io::ErrorKind::PermissionDenied, message));
    }
    fs::canonicalize(path).map(Some)
}

/// Returns the directory of a file.
pub(crate) fn directory_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn follows_links_and_keeps_permissions() {
        use std::os::unix::fs::{PermissionsExt, symlink};

        let scratch = tempfile::tempdir().unwrap();
        let path_of = |name: &str| scratch.path().join(name);
        std::fs::create_dir(path_of("folder")).unwrap();
        std::fs::write(path_of("folder/new"), "old").unwrap();
        symlink("folder/new", path_of("link")).unwrap();
        symlink("link", path_of("link-to-link")).unwrap();
        for bytes in [b"one", b"two"] {
            write_atomic(&path_of("link-to-link"), bytes).unwrap();
            assert_eq!(std::fs::read(path_of("folder/new")).unwrap(), bytes);
        }
        assert!(path_of("link").is_symlink() && path_of("link-to-link").is_symlink());
        assert!(!path_of("folder/new").is_symlink());

        let set_mode =
            |mode| std::fs::set_permissions(path_of("link"), PermissionsExt::from_mode(mode));
        set_mode(0o640).unwrap();
        write_atomic(&path_of("folder/new"), b"three").unwrap();
        let permissions = std::fs::metadata(path_of("folder/new"))
            .unwrap()
            .permissions();
        assert_eq!(permissions.mode() & 0o777, 0o640);

        set_mode(0o444).unwrap();
        for result in [
            write_atomic(&path_of("link"), b"four"),
            check_writable(&path_of("link")),
        ] {
            assert_eq!(result.unwrap_err().kind(), io::ErrorKind::PermissionDenied);
        }
        assert_eq!(std::fs::read(path_of("folder/new")).unwrap(), b"three");
        assert_eq!(std::fs::read_dir(path_of("folder")).unwrap().count(), 1);
    }

    #[test]
    fn checks_and_failed_writes_leave_no_file() {
        let scratch = tempfile::tempdir().unwrap();
        check_writable(&scratch.path().join("file")).unwrap();
        let directory = scratch.path().join("directory");
        std::fs::create_dir(&directory).unwrap();
        for path in [&directory, &scratch.path().join("none/file")] {
            assert!(check_writable(path).is_err());
            assert!(write_atomic(path, b"one").is_err());
        }
        assert_eq!(std::fs::read_dir(scratch.path()).unwrap().count(), 1);
    }
}
