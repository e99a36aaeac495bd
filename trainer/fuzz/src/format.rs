//! Which format a file has, by what is in it: one of them, or a message.

use glimpse_materials::{Format, Source};

use crate::{Folder, refused};

const NAMES: [&str; 6] = [
    "felt.binary",
    "felt.bsdf",
    "felt",
    "felt.txt",
    "felt_fc1.npy",
    "felt.json",
];

/// Checks one input.
pub fn check(input: &[u8]) {
    let Some((which, bytes)) = input.split_first() else {
        return;
    };
    let folder = Folder::new();
    let name = NAMES[usize::from(*which) % NAMES.len()];
    let path = folder.write(name, bytes);
    let source = Source(path.display().to_string());
    match Format::of(&path) {
        // Its files are those that its reader reads; a set of texts may be told to be none.
        Ok(_) => match source.files() {
            Ok(files) => assert!(files.contains(&path)),
            Err(error) => refused(&error, name),
        },
        Err(error) => refused(&error, name),
    }
    let _ = Source(folder.path().display().to_string()).skipped_entries();
}
