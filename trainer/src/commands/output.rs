//! Output files. Commands never overwrite their inputs, and overwrite valuable results only with `--force`.

use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use glimpse_core::model::linear::format::MAGIC as COMPACT_MAGIC;
use glimpse_core::recipe::MAGIC;
use glimpse_materials::basis::BASIS_MAGIC;
use glimpse_materials::files::{check_writable, ensure_dir, has_content, write_atomic};
use glimpse_materials::{FittedMaterial, Source};
use serde_json::{Value, json};

/// Writes a file atomically, and reports it on stderr.
///
/// # Errors
/// If the path holds a different recipe, material or sheet of readings, or if writing fails.
pub(crate) fn write_file(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    refuse_overwrite(path, bytes)?;
    replace(path, bytes)
}

/// Fails where [`write_file`] would fail, before the content exists.
pub(super) fn refuse_unwritable(path: &Path) -> anyhow::Result<()> {
    refuse_overwrite(path, &[])?;
    check_writable(path, 1).with_context(|| format!("cannot write {}", path.display()))
}

fn refuse_overwrite(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    match valuable_content(path, bytes) {
        Some(content) => bail!(
            "{} holds {content}, which would be overwritten: give another --out, or remove the file",
            path.display()
        ),
        None => Ok(()),
    }
}

/// Writes a file for a command with the option --force, which replaces any file.
pub(super) fn write_file_forced(path: &Path, bytes: &[u8], force: bool) -> anyhow::Result<()> {
    write_files_forced(&[(path.to_owned(), bytes.to_vec())], force)
}

/// Writes a group of files, as [`write_file_forced`] does; writes none if one must not be replaced.
pub(super) fn write_files_forced(files: &[(PathBuf, Vec<u8>)], force: bool) -> anyhow::Result<()> {
    for (path, bytes) in files {
        if !force && let Some(content) = valuable_content(path, bytes) {
            bail!(
                "{} holds {content}, which would be overwritten: give --force to replace it, or another output",
                path.display()
            );
        }
    }
    let mut files = files.iter();
    files.try_for_each(|(path, bytes)| replace(path, bytes))
}

fn replace(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    write_atomic(path, bytes).with_context(|| format!("cannot write {}", path.display()))?;
    // A closed stderr must not stop a group of files halfway.
    let _ = writeln!(io::stderr(), "wrote {}", path.display());
    Ok(())
}

/// Describes the valuable file at a path that these bytes would replace: a result of training, or measurements.
/// Returns None for other files, and if the file holds the same bytes.
fn valuable_content(path: &Path, bytes: &[u8]) -> Option<&'static str> {
    if !path.is_file() {
        return None;
    }
    let mut head = [0; 4];
    File::open(path).ok()?.read_exact(&mut head).ok()?;
    let content = match &head {
        head if *head == MAGIC => "a recipe",
        head if [BASIS_MAGIC, COMPACT_MAGIC].contains(head) => "the basis of a recipe",
        // RGL's tensor file, MERL's table whose first dimension is 90, NumPy's array.
        b"tens" | b"\x5a\0\0\0" | b"\x93NUM" => "another material",
        [b'{', ..] if FittedMaterial::is_fitted_file(path) => "a fitted material",
        // A header that begins with the column `index`.
        b"inde" if has_readings(path) => "a sheet of readings",
        _ => return None,
    };
    (!has_content(path, bytes)).then_some(content)
}

/// Returns true if a table contains a reading in its column `r` or `value`: a filled-in sheet of `trainer plan
/// --blank`, or `readings.csv` of `trainer fit`.
fn has_readings(path: &Path) -> bool {
    let Ok(mut sheet) = csv::Reader::from_path(path) else {
        return false;
    };
    let Ok(header) = sheet.headers() else {
        return false;
    };
    let is_reading = |name: &str| ["r", "value"].contains(&name);
    let Some(column) = header.iter().position(is_reading) else {
        return false;
    };
    let has_value = |row: csv::StringRecord| row.get(column).is_some_and(|cell| !cell.is_empty());
    // A malformed row counts as a reading, since it may have been edited by hand.
    sheet.records().any(|row| row.map_or(true, has_value))
}

/// The JSON object of a file that a command wrote. `bytes` is null for a pipe or a device.
pub(super) fn file_as_json(path: &Path) -> Value {
    let metadata = fs::metadata(path).ok().filter(fs::Metadata::is_file);
    json!({ "path": path.display().to_string(), "bytes": metadata.map(|file| file.len()) })
}

/// Creates a command's output folder. Its parent folder must exist.
pub(super) fn create_out_folder(folder: &Path) -> anyhow::Result<()> {
    ensure_dir(folder).with_context(|| format!("cannot write to {}", folder.display()))
}

/// Refuses an output that is an input of the command.
pub(super) fn refuse_input(out: &Path, input: &Path) -> anyhow::Result<()> {
    ensure!(
        !is_same_file(out, input),
        "{} is an input of this command ({}) and would be overwritten: give another output",
        out.display(),
        input.display()
    );
    Ok(())
}

/// Refuses an output that is a file of the materials' source.
pub(super) fn refuse_source(out: &Path, source: &Source) -> anyhow::Result<()> {
    let Ok(files) = source.files() else {
        // Loading the source reports its error.
        return Ok(());
    };
    files.iter().try_for_each(|file| refuse_input(out, file))
}

/// Returns true if both paths lead to the same regular file, also through links.
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
    fn recognizes_same_file_by_other_paths() {
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
    fn keeps_valuable_files() {
        let scratch = tempfile::tempdir().unwrap();
        let path = scratch.path().join("a");
        fs::write(&path, "GLMP and more").unwrap();
        assert!(write_file(&path, b"other").is_err());
        assert!(write_file_forced(&path, b"other", false).is_err());
        assert!(write_file(&path, b"GLMP and more").is_ok());
        assert!(write_file_forced(&path, b"other", true).is_ok());
        assert!(write_file(&path, b"again").is_ok());
        assert_eq!(fs::read(&path).unwrap(), b"again");

        fs::write(&path, "index,theta_i,r,g,b\n0,30,1,1,1\n").unwrap();
        assert!(write_file(&path, b"other").is_err());
        // Empty sheets, plans and tables of angles are quick to make again.
        for replaceable in ["index,theta_i,r,g,b\n0,30,,,\n", "index,theta_i\n0,30\n"] {
            fs::write(&path, replaceable).unwrap();
            write_file(&path, b"other").unwrap();
        }
    }
}
