//! Output files. Commands never overwrite their inputs, and replace files that differ only with `--force`.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use glimpse_materials::Source;
use glimpse_materials::basis::BasisTable;
use glimpse_materials::files::{check_writable, ensure_dir, has_content, write_atomic};
use serde_json::{Value, json};

/// Writes one file, as [`write_files`] does.
pub(crate) fn write_file(path: &Path, bytes: &[u8], force: bool) -> anyhow::Result<()> {
    write_files(&[(path.to_owned(), bytes.to_vec())], force)
}

/// Writes a group of files, each atomically, and reports them on stderr.
///
/// # Errors
/// If a file exists with other content and `force` is false; then no file is written. If writing fails.
pub(crate) fn write_files(files: &[(PathBuf, Vec<u8>)], force: bool) -> anyhow::Result<()> {
    for (path, bytes) in files {
        ensure!(
            force || !path.is_file() || has_content(path, bytes),
            "{} exists and differs: give --force to replace it, or another output",
            path.display()
        );
    }
    for (path, bytes) in files {
        write_atomic(path, bytes).with_context(|| format!("cannot write {}", path.display()))?;
        // A closed stderr must not stop a group of files halfway.
        let _ = writeln!(io::stderr(), "wrote {}", path.display());
    }
    Ok(())
}

/// Checks that a file can be written, before a long computation.
pub(crate) fn check_out(path: &Path) -> anyhow::Result<()> {
    check_writable(path).with_context(|| format!("cannot write {}", path.display()))
}

/// The JSON object of a file that a command wrote. `bytes` is null for a pipe or a device.
pub(crate) fn file_as_json(path: &Path) -> Value {
    let metadata = fs::metadata(path).ok().filter(fs::Metadata::is_file);
    json!({ "path": path.display().to_string(), "bytes": metadata.map(|file| file.len()) })
}

/// Creates a command's output folder. Its parent folder must exist.
pub(crate) fn create_out_folder(folder: &Path) -> anyhow::Result<()> {
    ensure_dir(folder).with_context(|| format!("cannot write to {}", folder.display()))
}

/// Refuses an output that is an input of the command.
pub(crate) fn refuse_input(out: &Path, input: &Path) -> anyhow::Result<()> {
    ensure!(
        !is_same_file(out, input),
        "{} is an input of this command ({}) and would be overwritten: give another output",
        out.display(),
        input.display()
    );
    Ok(())
}

/// Refuses an output that is a recipe of the command, or its basis.
pub(crate) fn refuse_recipe(out: &Path, recipe: &Path) -> anyhow::Result<()> {
    refuse_input(out, recipe)?;
    refuse_input(out, &BasisTable::path_for(recipe))
}

/// Refuses an output that is a file of the materials' source.
pub(crate) fn refuse_source(out: &Path, source: &Source) -> anyhow::Result<()> {
    let Ok(files) = source.files() else {
        // Loading the source reports its error.
        return Ok(());
    };
    files.iter().try_for_each(|file| refuse_input(out, file))
}

/// Returns true if both paths lead to the same regular file, also through symbolic links. A hard link keeps its content when
/// the other one is replaced.
pub(crate) fn is_same_file(one: &Path, other: &Path) -> bool {
    let canonical =
        [one, other].map(|path| fs::canonicalize(path).ok().filter(|path| path.is_file()));
    matches!(&canonical, [Some(one), Some(other)] if one == other)
}

/// Returns the extension of an output path, in lower case, which must be one of `types`.
pub(crate) fn file_type(path: &Path, types: &[&'static str]) -> anyhow::Result<&'static str> {
    let extension = path.extension().and_then(|extension| extension.to_str());
    let extension = extension.unwrap_or_default().to_ascii_lowercase();
    match types.iter().find(|known| **known == extension) {
        Some(file_type) => Ok(file_type),
        None => bail!(
            "--out {}: unsupported file type, give a name with the extension .{}",
            path.display(),
            types.join(" or .")
        ),
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
            assert!(refuse_input(&at("link"), &at("a")).is_err());
        }
    }
}
