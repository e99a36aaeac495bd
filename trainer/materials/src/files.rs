//! Files written whole or not at all, and through to what is no regular file.

use std::fs::{self, OpenOptions};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

/// Writes a file so that, whatever happens, a reader finds the old content or all of the new.
///
/// The bytes go to a temporary file in the same directory, which then takes the name and the
/// permissions of the old one. A link stays a link: what it leads to is written. What writes of the
/// same file that were killed have left there is removed. A pipe or a device is not replaced by a
/// file but written to.
///
/// # Errors
/// If the operating system refuses, the file is read-only, or its directory is not there; nothing
/// is left behind then.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let path = match Target::of(path)? {
        Target::Stream => return OpenOptions::new().append(true).open(path)?.write_all(bytes),
        Target::File(path) => path,
    };
    remove_unfinished(&path)?;
    let mut file = unfinished(&path)?;
    if let Ok(old) = fs::metadata(&path) {
        file.as_file().set_permissions(old.permissions())?;
    }
    file.write_all(bytes)?;
    file.as_file().sync_all()?;
    file.persist(&path)?;
    Ok(())
}

/// The same for a file at a relative path below a folder, whose own folders are made; `folder` must
/// be there.
///
/// # Errors
/// As [`write_atomic`].
pub fn write_atomic_below(folder: &Path, relative: &Path, bytes: &[u8]) -> io::Result<()> {
    let path = folder.join(relative);
    require_parent_dir(&folder.join("file"))?;
    ensure_dir_all(directory_of(&path))?;
    write_atomic(&path, bytes)
}

/// Makes sure, before hours are spent, that a file of so many bytes could be written: tries it
/// under another name, and leaves nothing. Whether a pipe or a device will take them is not known
/// before.
///
/// # Errors
/// If it could not.
pub fn check_writable(path: &Path, bytes: usize) -> io::Result<()> {
    let Target::File(path) = Target::of(path)? else {
        return Ok(());
    };
    let mut file = unfinished(&path)?;
    file.write_all(&vec![0xa5; bytes])?;
    file.as_file().sync_all()
}

/// Makes a directory, unless it exists. Its parent must exist.
///
/// # Errors
/// If it cannot be made. The kind is [`io::ErrorKind::NotADirectory`] if a file has this path.
pub fn ensure_dir(path: &Path) -> io::Result<()> {
    if path.is_dir() {
        return Ok(());
    }
    refuse_file_above(path)?;
    require_parent_dir(path)?;
    fs::create_dir(path)
}

/// Makes a directory and all above it, unless they exist.
///
/// # Errors
/// As [`ensure_dir`].
pub fn ensure_dir_all(path: &Path) -> io::Result<()> {
    refuse_file_above(path)?;
    fs::create_dir_all(path)
}

/// Makes sure that the directory of a file exists.
///
/// # Errors
/// If it does not. The kind is [`io::ErrorKind::NotADirectory`] if it is a file.
pub fn require_parent_dir(path: &Path) -> io::Result<()> {
    let folder = directory_of(path);
    refuse_file_above(folder)?;
    match folder.exists() {
        true => Ok(()),
        false => Err(missing(folder)),
    }
}

/// Returns true if a file holds exactly these bytes.
#[must_use]
pub fn has_content(path: &Path, bytes: &[u8]) -> bool {
    let has_length = |found: fs::Metadata| found.len() == bytes.len() as u64;
    fs::metadata(path).is_ok_and(has_length) && fs::read(path).is_ok_and(|found| found == bytes)
}

/// Refuses a path that is a file, or leads through one, where a directory is needed.
fn refuse_file_above(path: &Path) -> io::Result<()> {
    match path.ancestors().find(|part| part.exists()) {
        Some(part) if !part.is_dir() => {
            let what = format!(
                "{} is a file, and a directory is needed here; give the path of a directory",
                part.display()
            );
            Err(io::Error::new(io::ErrorKind::NotADirectory, what))
        }
        _ => Ok(()),
    }
}

/// True of a pipe, a device or a socket: what is written to and never replaced.
#[must_use]
pub fn is_stream(path: &Path) -> bool {
    matches!(Target::of(path), Ok(Target::Stream))
}

/// What a path leads to.
enum Target {
    /// A regular file, there or not yet, by its own name and not by that of a link to it.
    File(PathBuf),
    /// What is written through to.
    Stream,
}

impl Target {
    fn of(path: &Path) -> io::Result<Self> {
        let metadata = match fs::metadata(path) {
            Ok(metadata) => metadata,
            Err(error)
                if [io::ErrorKind::NotFound, io::ErrorKind::NotADirectory]
                    .contains(&error.kind()) =>
            {
                let path = end_of_links(path);
                require_parent_dir(&path)?;
                return Ok(Self::File(path));
            }
            Err(error) => return Err(error),
        };
        if metadata.is_dir() {
            return Err(io::ErrorKind::IsADirectory.into());
        }
        // `/dev/stdout` may lead to a regular file, which the shell has opened already.
        let opened = ["/dev/stdout", "/dev/stderr", "/dev/fd", "/proc"];
        if !metadata.is_file() || opened.iter().any(|opened| path.starts_with(opened)) {
            return Ok(Self::Stream);
        }
        if metadata.permissions().readonly() {
            let what = "the file is read-only";
            return Err(io::Error::new(io::ErrorKind::PermissionDenied, what));
        }
        fs::canonicalize(path).map(Self::File)
    }
}

/// What is at the end of links of which the last leads nowhere.
fn end_of_links(path: &Path) -> PathBuf {
    const MOST: usize = 40;
    let mut end = path.to_owned();
    for _ in 0..MOST {
        match fs::read_link(&end) {
            Ok(next) => end = directory_of(&end).join(next),
            Err(_) => break,
        }
    }
    end
}

fn missing(folder: &Path) -> io::Error {
    let what = format!("there is no folder {}; make it first", folder.display());
    io::Error::new(io::ErrorKind::NotFound, what)
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
        let path = scratch.path().join("file");
        write_atomic(&path, b"one").unwrap();
        write_atomic(&path, b"two").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"two");
        let beside = std::fs::read_dir(path.parent().unwrap()).unwrap();
        assert_eq!(beside.count(), 1);
    }

    #[test]
    fn no_folder_is_made_above_the_one_that_is_named() {
        let scratch = tempfile::tempdir().unwrap();
        let none = scratch.path().join("none");
        for refused in [
            write_atomic(&none.join("file"), b"one"),
            check_writable(&none.join("file"), 1),
            write_atomic_below(&none, Path::new("file"), b"one"),
            ensure_dir(&none.join("deeper")),
        ] {
            assert_eq!(refused.unwrap_err().kind(), io::ErrorKind::NotFound);
        }
        assert!(!none.exists());
        ensure_dir(&none).unwrap();
        ensure_dir(&none).unwrap();
        write_atomic_below(&none, Path::new("a/b/file"), b"one").unwrap();
        assert_eq!(std::fs::read(none.join("a/b/file")).unwrap(), b"one");
        assert!(ensure_dir(&none.join("a/b/file")).is_err());
    }

    #[test]
    fn a_file_in_place_of_a_directory_is_named() {
        let scratch = tempfile::tempdir().unwrap();
        let file = scratch.path().join("file");
        std::fs::write(&file, "kept").unwrap();
        for refused in [
            ensure_dir(&file),
            ensure_dir(&file.join("deeper")),
            write_atomic(&file.join("deeper"), b"one"),
            check_writable(&file.join("deeper"), 1),
            write_atomic_below(scratch.path(), Path::new("file/deeper"), b"one"),
        ] {
            let error = refused.unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::NotADirectory);
            let named = file.display().to_string();
            assert!(error.to_string().contains(&named), "{error}");
        }
        assert!(has_content(&file, b"kept"));
        for other in [&b"keep"[..], b"kept longer", b""] {
            assert!(!has_content(&file, other));
        }
        assert!(!has_content(scratch.path(), b"kept"));
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed_and_permissions_kept() {
        use std::os::unix::fs::{PermissionsExt, symlink};

        let scratch = tempfile::tempdir().unwrap();
        let at = |name: &str| scratch.path().join(name);
        std::fs::create_dir(at("folder")).unwrap();
        symlink("folder/new", at("link")).unwrap();
        symlink("link", at("link-to-link")).unwrap();
        for bytes in [b"one", b"two"] {
            write_atomic(&at("link-to-link"), bytes).unwrap();
            assert_eq!(std::fs::read(at("folder/new")).unwrap(), bytes);
        }
        assert!(at("link").is_symlink() && at("link-to-link").is_symlink());
        assert!(!at("folder/new").is_symlink());

        let mode = |mode| std::fs::set_permissions(at("link"), PermissionsExt::from_mode(mode));
        mode(0o640).unwrap();
        write_atomic(&at("folder/new"), b"three").unwrap();
        let kept = std::fs::metadata(at("folder/new")).unwrap().permissions();
        assert_eq!(kept.mode() & 0o777, 0o640);

        mode(0o444).unwrap();
        for refused in [
            write_atomic(&at("link"), b"four"),
            check_writable(&at("link"), 1),
        ] {
            assert_eq!(refused.unwrap_err().kind(), io::ErrorKind::PermissionDenied);
        }
        assert_eq!(std::fs::read(at("folder/new")).unwrap(), b"three");
        assert_eq!(std::fs::read_dir(at("folder")).unwrap().count(), 1);
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
        write_atomic(&path, b"one").unwrap();
        assert!(!left.exists());
        assert!(other.exists());
    }

    #[test]
    fn a_try_leaves_nothing_behind() {
        let scratch = tempfile::tempdir().unwrap();
        check_writable(&scratch.path().join("file"), 100).unwrap();
        assert_eq!(std::fs::read_dir(scratch.path()).unwrap().count(), 0);
        assert!(check_writable(scratch.path(), 100).is_err());
    }

    #[test]
    fn a_refusal_leaves_nothing_behind() {
        let scratch = tempfile::tempdir().unwrap();
        let directory = scratch.path().join("taken");
        std::fs::create_dir_all(directory.join("inside")).unwrap();
        assert!(write_atomic(&directory, b"one").is_err());
        assert_eq!(std::fs::read_dir(scratch.path()).unwrap().count(), 1);
    }
}
