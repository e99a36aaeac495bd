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
    folder.fail_each(
        "train --model linear --samples 4 --out x.recipe --data procedural:2",
        &[
            "--share 1 => --share",
            "--data procedural:2:1 --share 1 => --share",
            "--data procedural:2:1 --share 1,0 => --share",
            "--data procedural:3 => procedural:3",
            "--max-theta-i 20 --min-separation 50 => --min-separation",
            "--max-theta-i 120 => --max-theta-i",
            "--schedule prior --missing 1.5 => --missing",
            "--scan-seconds 2 => 2",
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
