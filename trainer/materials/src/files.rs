//! Atomic writes of files, and writes to pipes and devices.

use std::fs::{self, OpenOptions};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

/// Writes a file atomically: a reader sees either the complete old content or the complete new content.
///
/// The bytes go to a temporary file in the same directory, which then takes the name and the permissions of the old
/// file. A symbolic link is kept, and its target is written. Temporary files of earlier, interrupted writes of the same
/// file are removed. A pipe or a device is written to directly.
///
/// # Errors
/// If the operating system cannot write the file, the file is read-only, or its directory does not exist. The temporary
/// file is then removed.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let path = match Target::resolve(path)? {
        Target::Stream => return OpenOptions::new().append(true).open(path)?.write_all(bytes),
        Target::File(path) => path,
    };
    remove_temporary_files(&path)?;
    let mut file = temporary_file(&path)?;
    if let Ok(old) = fs::metadata(&path) {
        file.as_file().set_permissions(old.permissions())?;
    }
    file.write_all(bytes)?;
    file.as_file().sync_all()?;
    file.persist(&path)?;
    Ok(())
}

/// Writes a file atomically at a relative path below a directory. `directory` must exist; missing directories below it
/// are created.
///
/// # Errors
/// As [`write_atomic`].
pub fn write_atomic_below(directory: &Path, relative: &Path, bytes: &[u8]) -> io::Result<()> {
    let path = directory.join(relative);
    // The name of the file does not matter: only its parent is checked.
    require_parent_dir(&directory.join("file"))?;
    ensure_dir_all(directory_of(&path))?;
    write_atomic(&path, bytes)
}

/// Checks that a file of `bytes` bytes can be written, before a long computation. Writes a temporary file and removes
/// it. Pipes and devices are not checked.
///
/// # Errors
/// If the file cannot be written.
pub fn check_writable(path: &Path, bytes: usize) -> io::Result<()> {
    let Target::File(path) = Target::resolve(path)? else {
        return Ok(());
    };
    let mut file = temporary_file(&path)?;
    file.write_all(&vec![0xa5; bytes])?;
    file.as_file().sync_all()
}

/// Creates a directory unless it exists. Its parent must exist.
///
/// # Errors
/// If it cannot be created. The kind is [`io::ErrorKind::NotADirectory`] if a file has this path.
pub fn ensure_dir(path: &Path) -> io::Result<()> {
    if path.is_dir() {
        return Ok(());
    }
    reject_file_in_path(path)?;
    require_parent_dir(path)?;
    fs::create_dir(path)
}

/// Creates a directory and its parents unless they exist.
///
/// # Errors
/// As [`ensure_dir`].
pub fn ensure_dir_all(path: &Path) -> io::Result<()> {
    reject_file_in_path(path)?;
    fs::create_dir_all(path)
}

/// Checks that the directory of a file exists.
///
/// # Errors
/// If the directory does not exist. The kind is [`io::ErrorKind::NotADirectory`] if a file has its path.
pub fn require_parent_dir(path: &Path) -> io::Result<()> {
    let directory = directory_of(path);
    reject_file_in_path(directory)?;
    match directory.exists() {
        true => Ok(()),
        false => Err(missing_directory(directory)),
    }
}

/// Returns true if a file holds exactly these bytes.
#[must_use]
pub fn has_content(path: &Path, bytes: &[u8]) -> bool {
    let has_length = |metadata: fs::Metadata| metadata.len() == bytes.len() as u64;
    fs::metadata(path).is_ok_and(has_length) && fs::read(path).is_ok_and(|content| content == bytes)
}

/// Returns an error if a directory's path is a file or leads through one.
fn reject_file_in_path(path: &Path) -> io::Result<()> {
    match path.ancestors().find(|part| part.exists()) {
        Some(part) if !part.is_dir() => {
            let message = format!(
                "{} is a file where a directory is needed; give the path of a directory",
                part.display()
            );
            Err(io::Error::new(io::ErrorKind::NotADirectory, message))
        }
        _ => Ok(()),
    }
}

/// Returns true if a path is a pipe, a device or a socket, which is written to and never replaced.
#[must_use]
pub fn is_stream(path: &Path) -> bool {
    matches!(Target::resolve(path), Ok(Target::Stream))
}

/// The target of a write.
enum Target {
    /// A regular file, which may not exist yet. The path is free of symbolic links.
    File(PathBuf),
    /// A pipe, a device or a socket.
    Stream,
}

impl Target {
    fn resolve(path: &Path) -> io::Result<Self> {
        let metadata = match fs::metadata(path) {
            Ok(metadata) => metadata,
            Err(error)
                if [io::ErrorKind::NotFound, io::ErrorKind::NotADirectory]
                    .contains(&error.kind()) =>
            {
                let path = follow_links(path);
                require_parent_dir(&path)?;
                return Ok(Self::File(path));
            }
            Err(error) => return Err(error),
        };
        if metadata.is_dir() {
            return Err(io::ErrorKind::IsADirectory.into());
        }
        // `/dev/stdout` may lead to a regular file that the shell has already opened.
        let stream_paths = ["/dev/stdout", "/dev/stderr", "/dev/fd", "/proc"];
        if !metadata.is_file() || stream_paths.iter().any(|prefix| path.starts_with(prefix)) {
            return Ok(Self::Stream);
        }
        if metadata.permissions().readonly() {
            let message = "the file is read-only; make it writable, or write to another path";
            return Err(io::Error::new(io::ErrorKind::PermissionDenied, message));
        }
        fs::canonicalize(path).map(Self::File)
    }
}

/// Follows symbolic links to a target that does not exist.
fn follow_links(path: &Path) -> PathBuf {
    const MAX_LINKS: usize = 40;
    let mut target = path.to_owned();
    for _ in 0..MAX_LINKS {
        match fs::read_link(&target) {
            Ok(next) => target = directory_of(&target).join(next),
            Err(_) => break,
        }
    }
    target
}

/// Returns the error of a directory that does not exist.
fn missing_directory(directory: &Path) -> io::Error {
    let message = format!(
        "the directory {} does not exist; create it first",
        directory.display()
    );
    io::Error::new(io::ErrorKind::NotFound, message)
}

fn directory_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// Returns the prefix of the names of a file's temporary files.
fn temporary_prefix(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    format!(".unfinished-{name}-")
}

/// Creates a temporary file in the directory of `path`. Dropping the handle removes the file.
fn temporary_file(path: &Path) -> io::Result<NamedTempFile> {
    let prefix = temporary_prefix(path);
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix);
    // By default, only the owner can read a temporary file. This one becomes an ordinary file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(directory_of(path))
}

/// Removes the temporary files of earlier, interrupted writes of `path`.
fn remove_temporary_files(path: &Path) -> io::Result<()> {
    let prefix = temporary_prefix(path);
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
    fn replaces_a_file_and_leaves_no_temporary_file() {
        let scratch = tempfile::tempdir().unwrap();
        let path = scratch.path().join("file");
        write_atomic(&path, b"one").unwrap();
        write_atomic(&path, b"two").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"two");
        let entries = std::fs::read_dir(path.parent().unwrap()).unwrap();
        assert_eq!(entries.count(), 1);
    }

    #[test]
    fn does_not_create_parent_directories() {
        let scratch = tempfile::tempdir().unwrap();
        let missing = scratch.path().join("missing");
        for result in [
            write_atomic(&missing.join("file"), b"one"),
            check_writable(&missing.join("file"), 1),
            write_atomic_below(&missing, Path::new("file"), b"one"),
            ensure_dir(&missing.join("deeper")),
        ] {
            assert_eq!(result.unwrap_err().kind(), io::ErrorKind::NotFound);
        }
        assert!(!missing.exists());
        ensure_dir(&missing).unwrap();
        ensure_dir(&missing).unwrap();
        write_atomic_below(&missing, Path::new("a/b/file"), b"one").unwrap();
        assert_eq!(std::fs::read(missing.join("a/b/file")).unwrap(), b"one");
        assert!(ensure_dir(&missing.join("a/b/file")).is_err());
    }

    #[test]
    fn error_names_a_file_in_place_of_a_directory() {
        let scratch = tempfile::tempdir().unwrap();
        let file = scratch.path().join("file");
        std::fs::write(&file, "kept").unwrap();
        for result in [
            ensure_dir(&file),
            ensure_dir(&file.join("deeper")),
            write_atomic(&file.join("deeper"), b"one"),
            check_writable(&file.join("deeper"), 1),
            write_atomic_below(scratch.path(), Path::new("file/deeper"), b"one"),
        ] {
            let error = result.unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::NotADirectory);
            let path = file.display().to_string();
            assert!(error.to_string().contains(&path), "{error}");
        }
        assert!(has_content(&file, b"kept"));
        for other in [&b"keep"[..], b"kept longer", b""] {
            assert!(!has_content(&file, other));
        }
        assert!(!has_content(scratch.path(), b"kept"));
    }

    #[cfg(unix)]
    #[test]
    fn follows_links_and_keeps_permissions() {
        use std::os::unix::fs::{PermissionsExt, symlink};

        let scratch = tempfile::tempdir().unwrap();
        let path_of = |name: &str| scratch.path().join(name);
        std::fs::create_dir(path_of("folder")).unwrap();
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
            check_writable(&path_of("link"), 1),
        ] {
            assert_eq!(result.unwrap_err().kind(), io::ErrorKind::PermissionDenied);
        }
        assert_eq!(std::fs::read(path_of("folder/new")).unwrap(), b"three");
        assert_eq!(std::fs::read_dir(path_of("folder")).unwrap().count(), 1);
    }

    #[test]
    fn removes_temporary_files_of_interrupted_writes() {
        let scratch = tempfile::tempdir().unwrap();
        let path = scratch.path().join("file");
        let (_, leftover) = temporary_file(&path).unwrap().keep().unwrap();
        let (_, of_other_file) = temporary_file(&scratch.path().join("other"))
            .unwrap()
            .keep()
            .unwrap();
        write_atomic(&path, b"one").unwrap();
        assert!(!leftover.exists());
        assert!(of_other_file.exists());
    }

    #[test]
    fn check_writable_leaves_no_file() {
        let scratch = tempfile::tempdir().unwrap();
        check_writable(&scratch.path().join("file"), 100).unwrap();
        assert_eq!(std::fs::read_dir(scratch.path()).unwrap().count(), 0);
        assert!(check_writable(scratch.path(), 100).is_err());
    }

    #[test]
    fn failed_write_leaves_no_file() {
        let scratch = tempfile::tempdir().unwrap();
        let directory = scratch.path().join("directory");
        std::fs::create_dir_all(directory.join("inside")).unwrap();
        assert!(write_atomic(&directory, b"one").is_err());
        assert_eq!(std::fs::read_dir(scratch.path()).unwrap().count(), 1);
    }
}
