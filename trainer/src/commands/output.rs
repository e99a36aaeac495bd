//! What commands write: never over what they read, and not over hours of work without a word.

use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use glimpse_core::model::linear::format::MAGIC as COMPACT_MAGIC;
use glimpse_core::recipe::MAGIC;
use glimpse_materials::basis::BASIS_MAGIC;
use glimpse_materials::files::{holds, make_folder, try_write, write_whole};
use glimpse_materials::{FittedMaterial, Source};
use serde_json::{Value, json};

/// Writes a file whole or not at all, and says so. A recipe, a material or a sheet of readings that is there, and is
/// not the same, stays.
pub(crate) fn write_file(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    refuse_work(path, bytes)?;
    write_over(path, bytes)
}

/// Refuses what [`write_file`] would, before there is something to write.
pub(super) fn refuse_unwritable(path: &Path) -> anyhow::Result<()> {
    refuse_work(path, &[])?;
    try_write(path, 1).with_context(|| format!("cannot write {}", path.display()))
}

fn refuse_work(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    match work_at(path, bytes) {
        Some(what) => bail!(
            "{} is {what} that would be lost: give another --out, or remove it",
            path.display()
        ),
        None => Ok(()),
    }
}

/// Writes a file for commands with an option --force: with it, whatever is there goes.
pub(super) fn write_file_forced(path: &Path, bytes: &[u8], force: bool) -> anyhow::Result<()> {
    write_files_forced(&[(path.to_owned(), bytes.to_vec())], force)
}

/// The same for files that belong together: none of them is written if one has to stay.
pub(super) fn write_files_forced(files: &[(PathBuf, Vec<u8>)], force: bool) -> anyhow::Result<()> {
    for (path, bytes) in files {
        if !force && let Some(what) = work_at(path, bytes) {
            bail!(
                "{} is {what} that would be lost: give --force to replace it, or another output",
                path.display()
            );
        }
    }
    let mut files = files.iter();
    files.try_for_each(|(path, bytes)| write_over(path, bytes))
}

fn write_over(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    write_whole(path, bytes).with_context(|| format!("cannot write {}", path.display()))?;
    // Whoever has stopped listening does not stop what is half done.
    let _ = writeln!(io::stderr(), "wrote {}", path.display());
    Ok(())
}

/// What training or a scanner has left at a path and these bytes would replace, in words; None if nothing.
fn work_at(path: &Path, bytes: &[u8]) -> Option<&'static str> {
    if !path.is_file() {
        return None;
    }
    let mut head = [0; 4];
    File::open(path).ok()?.read_exact(&mut head).ok()?;
    let what = match &head {
        head if *head == MAGIC => "a recipe",
        head if [BASIS_MAGIC, COMPACT_MAGIC].contains(head) => "the basis of a recipe",
        // A tensor file, a table whose first dimension is 90, an array of NumPy's.
        b"tens" | b"\x5a\0\0\0" | b"\x93NUM" => "another material",
        [b'{', ..] if FittedMaterial::is_one(path) => "a fitted material",
        b"inde" if is_filled_in(path) => "a sheet of readings",
        _ => return None,
    };
    (!holds(path, bytes)).then_some(what)
}

/// True of a table in which somebody has written what was read of a recipe's samples, as a sheet of `trainer plan
/// --blank` is to be filled in and `trainer fit` leaves it.
fn is_filled_in(path: &Path) -> bool {
    let Ok(mut sheet) = csv::Reader::from_path(path) else {
        return false;
    };
    let Ok(header) = sheet.headers() else {
        return false;
    };
    let is_read = |name: &str| ["r", "value"].contains(&name);
    let Some(column) = header.iter().position(is_read) else {
        return false;
    };
    let filled = |row: csv::StringRecord| row.get(column).is_some_and(|cell| !cell.is_empty());
    // A row that is cut short is somebody's work too.
    sheet.records().any(|row| row.map_or(true, filled))
}

/// A file that a command has written, for its JSON. `bytes` is null of a pipe or a device.
pub(super) fn file_as_json(path: &Path) -> Value {
    let metadata = fs::metadata(path).ok().filter(fs::Metadata::is_file);
    json!({ "path": path.display().to_string(), "bytes": metadata.map(|found| found.len()) })
}

/// Makes a command's folder, but none above it.
pub(super) fn make_out(folder: &Path) -> anyhow::Result<()> {
    make_folder(folder).with_context(|| format!("cannot write to {}", folder.display()))
}

/// Refuses to write to a file that the command reads.
pub(super) fn refuse_input(out: &Path, input: &Path) -> anyhow::Result<()> {
    ensure!(
        !is_same_file(out, input),
        "{} is what is read ({}), and would be lost: give another output",
        out.display(),
        input.display()
    );
    Ok(())
}

/// Refuses to write to a file that one of the materials is read from.
pub(super) fn refuse_source(out: &Path, source: &Source) -> anyhow::Result<()> {
    let Ok(files) = source.files() else {
        // What is wrong with it is said when it is read.
        return Ok(());
    };
    files.iter().try_for_each(|file| refuse_input(out, file))
}

/// True if both are the same regular file, by whatever names.
pub(super) fn is_same_file(one: &Path, other: &Path) -> bool {
    if !(one.is_file() && other.is_file()) {
        return false;
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;

        if let (Ok(one), Ok(other)) = (fs::metadata(one), fs::metadata(other)) {
            return (one.dev(), one.ino()) == (other.dev(), other.ino());
        }
    }
    match (fs::canonicalize(one), fs::canonicalize(other)) {
        (Ok(one), Ok(other)) => one == other,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_itself_by_every_name() {
        let scratch = tempfile::tempdir().unwrap();
        let at = |name: &str| scratch.path().join(name);
        fs::write(at("a"), "1").unwrap();
        fs::write(at("b"), "1").unwrap();
        assert!(refuse_input(&at("a"), &at("../x/../a")).is_ok());
        fs::create_dir(at("x")).unwrap();
        assert!(refuse_input(&at("a"), &at("x/../a")).is_err());
        assert!(refuse_input(&at("a"), &at("b")).is_ok());
        assert!(refuse_input(&at("new"), &at("new")).is_ok());
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("a", at("link")).unwrap();
            fs::hard_link(at("a"), at("hard")).unwrap();
            assert!(refuse_input(&at("link"), &at("a")).is_err());
            assert!(refuse_input(&at("a"), &at("hard")).is_err());
        }
    }

    #[test]
    fn what_was_trained_stays() {
        let scratch = tempfile::tempdir().unwrap();
        let path = scratch.path().join("a");
        fs::write(&path, "GLMP and more").unwrap();
        assert!(write_file(&path, b"other").is_err());
        assert!(write_file_forced(&path, b"other", false).is_err());
        assert!(write_file(&path, b"GLMP and more").is_ok());
        assert!(write_file_forced(&path, b"other", true).is_ok());
        assert!(write_file(&path, b"once more").is_ok());
        assert_eq!(fs::read(&path).unwrap(), b"once more");

        fs::write(&path, "index,theta_i,r,g,b\n0,30,1,1,1\n").unwrap();
        assert!(write_file(&path, b"other").is_err());
        // Empty sheets, plans and samples' angles are made again in no time.
        for lost in ["index,theta_i,r,g,b\n0,30,,,\n", "index,theta_i\n0,30\n"] {
            fs::write(&path, lost).unwrap();
            write_file(&path, b"other").unwrap();
        }
    }
}
