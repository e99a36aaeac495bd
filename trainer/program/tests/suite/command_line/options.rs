//! Options without effect are errors, and errors for numbers out of range state the range. `option_pairs.rs` tests other
//! commands.

use super::Folder;
use crate::common::assert_names;

#[test]
fn rejects_options_without_effect_and_numbers_out_of_range() {
    let folder = Folder::new();
    folder.fail_each(
        "",
        &[
            "reproduce bases --out paper --additional procedural:1 => --additional",
            "reproduce bases --out paper --most-samples 8 => --most-samples",
            "reproduce curves --seeds 0 => --seeds 0 1",
            "bench --model linear => linear",
        ],
    );
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
    assert!(folder.names("").is_empty(), "a file was written");
}
