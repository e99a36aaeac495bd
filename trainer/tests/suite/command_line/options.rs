//! Options without effect are errors, and errors for numbers out of range state the range.

use super::Folder;
use super::folder::PHONG_N8;
use crate::common::assert_names;

#[test]
fn rejects_options_without_effect() {
    let folder = Folder::new();
    let recipe = "evaluate --recipe r.recipe --test procedural:1";
    let train = "train --model phong --samples 8 --out r.recipe";
    let small_grid = "train --grid --model phong,neural --out grid";
    let bases = "reproduce bases --out paper";
    for (command, option, value) in [
        (recipe, "--seeds", "3"),
        ("evaluate --test procedural:1", "--recipe", ""),
        (train, "--bases", "5"),
        (train, "--eta", "40"),
        (small_grid, "--bases", "5"),
        ("train --grid --out grid", "--resume", ""),
        (bases, "--additional", "procedural:1"),
        (bases, "--most-samples", "8"),
    ] {
        folder.fail_naming(&format!("{command} {option} {value}"), &[option]);
    }
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

#[test]
fn completion_scripts_contain_commands() {
    let folder = Folder::new();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = folder.succeed(&format!("completion {shell}"));
        for word in [
            "trainer",
            "virtual-scanner",
            "reproduce",
            "checkpoint-every",
        ] {
            assert!(script.contains(word), "no {word} for {shell}");
        }
    }
}

/// A value with a leading minus is not parsed as an option: the error names the option, the value and the range.
#[test]
fn rejects_negative_numbers_with_range() {
    let folder = Folder::with("r.recipe", PHONG_N8);
    let recipe = "evaluate --recipe r.recipe --test procedural:1";
    let train = "train --model phong -n 8 --out r.recipe";
    let shares =
        "train --model phong -n 8 --out r.recipe --data procedural:2 --data procedural:3:1";
    let linear = "train --model linear --schedule paper -n 8 --out r.recipe";
    let plan = "plan r.recipe";
    let fit = "fit r.recipe --measurements m.csv --out fits";
    let sphere = "render sphere procedural:1";
    let view = "render view r.recipe --material procedural:1";
    let scanner = "virtual-scanner --material procedural:1";
    let export = "export r.recipe --format basis --out b";
    for (command, option, value, bound) in [
        (recipe, "--noise", "-0.1", "1"),
        (recipe, "--noise", "-inf", "1"),
        (recipe, "--additive", "-0.1", "1"),
        (recipe, "--levels", "-4", "4294967295"),
        (recipe, "--first", "-4", "4096"),
        (recipe, "--lose", "-4", "4096"),
        (recipe, "--seeds", "-4", "10000"),
        (recipe, "--seed", "-4", "18446744073709551615"),
        (recipe, "--threads", "-4", "1"),
        (linear, "--bases", "-4", "1024"),
        (linear, "--eta", "-4", "0"),
        (train, "--missing", "-0.5", "1"),
        (train, "--noise", "-0.5", "0.5"),
        (train, "--additive", "-0.5", "0.5"),
        (train, "--levels", "-5", "4294967295"),
        (train, "--procedural", "-0.5", "0.99"),
        (train, "--max-theta-i", "-5", "90"),
        (train, "--max-theta-o", "-5", "90"),
        (train, "--min-separation", "-5", "180"),
        (train, "--checkpoint-every", "-5", "1000000000"),
        (shares, "--share", "-3,1", "0"),
        (plan, "--speed", "-3,1,1,1", "1,000,000"),
        (plan, "--settle", "-3", "86,400"),
        (plan, "--max-theta-i", "-5", "90"),
        (plan, "--max-theta-o", "-5", "90"),
        (plan, "--min-separation", "-5", "180"),
        (fit, "--tolerance", "-5", "180"),
        (fit, "--white-reflectance", "-0.5,1,1", "2"),
        (fit, "--saturation", "-inf", "inf"),
        (sphere, "--size", "-5", "4096"),
        (sphere, "--columns", "-5", "4096"),
        (view, "--noise", "-0.5", "1"),
        (scanner, "--noise", "-0.5", "0"),
        (export, "--components", "-5", "1024"),
        ("bench", "--seconds", "-5", "3600"),
        ("reproduce curves", "--seeds", "-5", "10000"),
        ("reproduce curves", "--most-samples", "-5", "4096"),
    ] {
        let message = folder.fail(&format!("{command} {option} {value}"));
        // Of several numbers, the first one is out of range.
        let number = value.split(',').next().unwrap_or_default();
        for part in [option, number, bound] {
            assert!(message.contains(part), "no {part} in {message}");
        }
        assert_eq!(folder.names(""), ["r.recipe"], "{command} {option}");
    }
    assert_eq!(folder.read("r.recipe"), PHONG_N8);
}
