//! Check of format detection: it returns a format, or an error message.

use glimpse_materials::{Format, Source};

use crate::{Folder, check_rejection};

/// File names. The first byte of an input selects one.
const NAMES: [&str; 6] = [
    "input.binary",
    "input.bsdf",
    "input",
    "input.txt",
    "input_fc1.npy",
    "input.json",
];

/// Checks one input.
pub fn check(input: &[u8]) {
    let Some((name_index, bytes)) = input.split_first() else {
        return;
    };
    let folder = Folder::new();
    let name = NAMES[usize::from(*name_index) % NAMES.len()];
    let path = folder.write(name, bytes);
    let source = Source(path.display().to_string());
    match Format::detect(&path) {
        // The list of files includes the path. A PAB-Opto file can still be rejected with its set.
        Ok(_) => match source.files() {
            Ok(files) => assert!(files.contains(&path)),
            Err(error) => check_rejection(&error, name),
        },
        Err(error) => check_rejection(&error, name),
    }
    let _ = Source(folder.path().display().to_string()).skipped_entries();
}
