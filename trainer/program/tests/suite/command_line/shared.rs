//! Results of commands that take seconds. Each command runs once, and every test gets a copy of the result.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use super::folder::Folder;

/// A training with schedule paper; `prior.rs` tests the default schedule.
pub(crate) const TRAIN: &str = "train --model phong --samples 4 --data procedural:12 --effort brief \
                                --out phong.recipe --schedule paper";
/// A recipe of the model Phong, `phong.recipe`.
pub(crate) static PHONG: Shared = Shared::of(TRAIN);
/// A recipe of the model Linear and its basis, `linear-n2.recipe`.
pub(crate) static LINEAR_N2: Shared = Shared::of(
    "train --model linear --schedule paper --samples 2 --data procedural:6 --effort brief \
     --out linear-n2.recipe",
);
/// A recipe of another n with the same basis, `linear-n4.recipe`.
pub(crate) static LINEAR_N4: Shared = Shared::of(
    "train --model linear --schedule paper --samples 4 --data procedural:6 --effort brief \
     --out linear-n4.recipe",
);
/// An experiment that trains Linear only, with the default output folder `paper`.
pub(crate) const BASES: &str =
    "reproduce bases --data procedural:4 --test procedural:1:1 --seeds 1 --effort brief";
/// The files of this experiment.
pub(crate) static EXPERIMENT: Shared = Shared::of(BASES);

/// The result of a command.
pub(crate) struct Shared {
    command: &'static str,
    result: OnceLock<Result>,
}

struct Result {
    printed: String,
    /// Paths within the command's folder, and their bytes.
    files: Vec<(PathBuf, Vec<u8>)>,
}

impl Shared {
    pub(crate) const fn of(command: &'static str) -> Self {
        Self {
            command,
            result: OnceLock::new(),
        }
    }

    /// Writes the command's files into a folder. Returns its stdout.
    pub(crate) fn copy_to(&self, directory: &Path) -> &str {
        let Result { printed, files } = self.result.get_or_init(|| Result::of(self.command));
        for (path, bytes) in files {
            let path = directory.join(path);
            fs::create_dir_all(path.parent().expect("a folder")).expect("the folder is created");
            fs::write(path, bytes).expect("the file is written");
        }
        printed
    }
}

impl Result {
    fn of(command: &str) -> Self {
        let folder = Folder::new();
        let printed = folder.succeed(command);
        Self {
            printed,
            files: files_below(folder.path()),
        }
    }
}

/// All files in a folder and its subfolders: their relative paths and their contents.
pub(crate) fn files_below(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).expect("a readable folder") {
        let entry = entry.expect("an entry");
        let name = PathBuf::from(entry.file_name());
        if entry.path().is_dir() {
            let below = files_below(&entry.path()).into_iter();
            files.extend(below.map(|(path, bytes)| (name.join(path), bytes)));
        } else {
            files.push((name, fs::read(entry.path()).expect("a readable file")));
        }
    }
    files
}
