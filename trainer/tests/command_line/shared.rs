//! Results of commands that take seconds: each is made once, and every test gets a copy of its own.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use super::succeed;

/// A recipe of the model Phong, `phong.recipe`.
pub(crate) static PHONG: Shared = Shared::of(
    "train --model phong --schedule joint --samples 4 --data procedural:12 --effort brief \
     --out phong.recipe",
);
/// A recipe of the model Linear and its basis, `linear-n2.recipe`.
pub(crate) static LINEAR_N2: Shared = Shared::of(
    "train --model linear --schedule joint --samples 2 --data procedural:6 --effort brief \
     --out linear-n2.recipe",
);
/// Another n with the same basis, `linear-n4.recipe`.
pub(crate) static LINEAR_N4: Shared = Shared::of(
    "train --model linear --schedule joint --samples 4 --data procedural:6 --effort brief \
     --out linear-n4.recipe",
);
/// An experiment that trains Linear only, without `--out`: in the folder `paper`.
pub(crate) const BASES: [&str; 10] = [
    "reproduce",
    "bases",
    "--data",
    "procedural:4",
    "--test",
    "procedural:1:1",
    "--seeds",
    "2",
    "--effort",
    "brief",
];
/// What it leaves.
pub(crate) static EXPERIMENT: Shared = Shared::of(
    "reproduce bases --data procedural:4 --test procedural:1:1 --seeds 2 --effort brief",
);

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
    const fn of(command: &'static str) -> Self {
        Self {
            command,
            result: OnceLock::new(),
        }
    }

    /// Writes the command's files into a folder; returns what it printed.
    pub(crate) fn copy_to(&self, directory: &Path) -> &str {
        let Result { printed, files } = self.result.get_or_init(|| Result::of(self.command));
        for (path, bytes) in files {
            let path = directory.join(path);
            fs::create_dir_all(path.parent().expect("a folder")).expect("it is made");
            fs::write(path, bytes).expect("it is written");
        }
        printed
    }
}

impl Result {
    fn of(command: &str) -> Self {
        let scratch = tempfile::tempdir().expect("a temporary directory");
        let words: Vec<&str> = command.split_whitespace().collect();
        let printed = succeed(scratch.path(), &words);
        let mut files = Vec::new();
        read_below(scratch.path(), Path::new(""), &mut files);
        Self { printed, files }
    }
}

/// Reads all files in a folder and below.
fn read_below(root: &Path, folder: &Path, files: &mut Vec<(PathBuf, Vec<u8>)>) {
    for entry in fs::read_dir(root.join(folder)).expect("it can be listed") {
        let path = folder.join(entry.expect("an entry").file_name());
        match root.join(&path).is_dir() {
            true => read_below(root, &path, files),
            false => {
                let bytes = fs::read(root.join(&path)).expect("it can be read");
                files.push((path, bytes));
            }
        }
    }
}
