//! Options without effect are errors, and errors for numbers out of range state the range.

use super::Folder;
use crate::common::assert_names;

#[test]
fn rejects_options_without_effect() {
    let folder = Folder::new();
    // `option_pairs.rs` tests the other commands.
    folder.fail_each(
        "reproduce bases --out paper",
        &[
            "--additional procedural:1 => --additional",
            "--most-samples 8 => --most-samples",
        ],
    );
    folder.fail_naming("bench --model linear", &["linear"]);
    assert_is_empty(&folder);
}

fn assert_is_empty(folder: &Folder) {
    assert!(folder.names("").is_empty(), "a file was written");
}

#[test]
fn errors_state_number_ranges() {
    let folder = Folder::new();
    for (command, option) in [
        ("train --model phong --out r.recipe", "-n"),
        ("reproduce curves", "--most-samples"),
    ] {
        for number in ["-3", "0", "4097", "1e20", "8.5", "many"] {
            let command = format!("{command} {option} {number}");
            folder.fail_naming(&command, &["1", "4096", number]);
        }
        let help = folder.succeed(&format!("{command} --help"));
        assert_names(&help, &["1", "4096"]);
    }
    for number in ["0", "-1", "1000000", "many"] {
        let bench = format!("bench --threads {number}");
        folder.fail_naming(&bench, &["--threads", number, "1"]);
    }
    folder.fail_naming("reproduce curves --seeds 0", &["--seeds", "0", "1"]);
    assert_is_empty(&folder);
}
