//! `trainer recipes`: bundled recipes.

use glimpse_fitting::bundled;
use glimpse_fitting::recipe::Metadata;

use super::{Folder, number};

#[test]
fn writes_bundled_recipes() {
    let folder = Folder::new();
    folder.succeed("recipes get linear-n8 neural-n16-masked --out mine");
    assert_eq!(folder.read("mine/linear-n8.basis"), bundled::BASIS);
    let neural = bundled::find("neural-n16-masked").expect("a bundled recipe");
    assert_eq!(folder.read("mine/neural-n16-masked.recipe"), neural.bytes);

    // A compact basis replaces the host's.
    let evaluate = "evaluate --test procedural:2:5 --recipe mine/linear-n8.recipe";
    let loss = number(&folder.succeed_as_json(evaluate)["loss"]);
    assert!(loss < 0.005, "{loss}");
    folder.succeed("render view mine/linear-n8.recipe --out view.html --material procedural:1:77");
    assert!(folder.exists("view.html"));

    folder.write("mine/phong-n1.recipe", neural.bytes);
    folder.fail_each(
        "",
        &[
            "recipes get neural-n3 => neural-n3",
            "recipes get phong-n1 --out mine => mine/phong-n1.recipe --force",
        ],
    );
}

#[test]
fn names_of_bundled_recipes_are_recipes() {
    let folder = Folder::new();
    folder.succeed("recipes get linear-n4");
    for command in ["inspect", "plan", "export --format json --out -"] {
        let [named, read] = ["linear-n4", "linear-n4.recipe"].map(|recipe| {
            let (command, options) = command.split_once(' ').unwrap_or((command, ""));
            folder.succeed(&format!("{command} {recipe} {options}"))
        });
        assert_eq!(named, read, "{command}");
    }
    folder.fail_naming("inspect linear-n5", &["linear-n5"]);
}

#[test]
fn lists_recipes_as_json() {
    let list = Folder::new().succeed_as_json("recipes list");
    let list = list.as_array().expect("a list");
    assert_eq!(list.len(), bundled::ALL.len());
    for (entry, bundled) in list.iter().zip(bundled::ALL) {
        let recipe = bundled.recipe();
        assert_eq!(entry["name"], bundled.name);
        let checksum = format!("{:08x}", recipe.checksum());
        assert_eq!(entry["checksum"], checksum);
        let seconds = entry["seconds"].as_f64();
        let metadata = Metadata::of(&recipe).expect("valid metadata");
        match metadata.scan_seconds() {
            Some(longest) => assert!(seconds <= Some(longest), "{entry}"),
            None if recipe.samples() == 0 => assert_eq!(seconds, None),
            None => assert!(seconds > Some(0.5 * recipe.samples() as f64), "{entry}"),
        }
    }
}

/// Files of the wrong format are not read to their end, since they may be endless.
#[cfg(target_os = "linux")]
#[test]
fn rejects_endless_files() {
    use std::process::Command;

    let folder = Folder::new();
    folder.succeed("recipes get linear-n1");
    for (command, file) in [
        ("inspect /dev/zero", "/dev/zero"),
        ("plan /dev/zero", "/dev/zero"),
        ("export /dev/zero --format json --out x", "/dev/zero"),
        (
            "evaluate --recipe linear-n1.recipe --test procedural:1 --basis /dev/zero",
            "/dev/zero",
        ),
        ("query procedural:1 --angles /dev/zero", "/dev/zero"),
        ("query /dev/zero --angles x", "x"),
    ] {
        // 2 GB of address space, including the threads' stacks.
        let limited = format!("ulimit -v 2000000 && exec \"$0\" {command}");
        let output = Command::new("sh")
            .args(["-c", &limited, env!("CARGO_BIN_EXE_trainer")])
            .current_dir(folder.path())
            .output()
            .expect("a shell runs");
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{command}: {message}");
        assert!(message.contains(file), "{command}: {message}");
    }
}
