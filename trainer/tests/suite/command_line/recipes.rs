//! `trainer recipes`: bundled recipes.

use std::fs;

use glimpse_trainer::bundled;
use serde_json::json;

use super::{Folder, number};

#[test]
fn bundled_recipes_are_listed_written_and_used() {
    let folder = Folder::new();
    let list = folder.succeed("recipes list");
    for bundled in bundled::ALL {
        let there = list.lines().any(|line| line.starts_with(bundled.name));
        assert!(there, "{} in {list}", bundled.name);
    }

    folder.succeed("recipes get linear-n8 neural-n16-masked --out mine");
    assert_eq!(folder.read("mine/linear-n8.basis"), bundled::BASIS);
    let neural = bundled::find("neural-n16-masked").expect("it is bundled");
    assert_eq!(folder.read("mine/neural-n16-masked.recipe"), neural.bytes);

    // The compact basis serves wherever a whole one does. (That it is a device's is tested beside core.)
    let evaluate = "evaluate --test procedural:2:5 --recipe mine/linear-n8.recipe";
    let loss = number(&folder.succeed_as_json(evaluate)["loss"]);
    assert!(loss < 0.005, "{loss}");
    folder.succeed("render view mine/linear-n8.recipe --out view.html --material procedural:1:77");
    assert!(folder.exists("view.html"));

    folder.write("mine/phong-n1.recipe", neural.bytes);
    for (command, named) in [
        (
            "export mine/linear-n8.recipe --format basis --out x.basis",
            &["mine/linear-n8.basis"][..],
        ),
        ("recipes get neural-n3", &["neural-n3"]),
        (
            "recipes get phong-n1 --out mine",
            &["mine/phong-n1.recipe", "--force"],
        ),
    ] {
        folder.fail_naming(command, named);
    }
}

#[test]
fn a_name_that_is_almost_right_is_suggested() {
    let folder = Folder::new();
    for (given, meant) in [
        ("linear-n16-maskd", "linear-n16-masked"),
        ("masked-n16", "linear-n16-masked"),
        ("masked-n16", "neural-n16-masked"),
        ("nural-n8", "neural-n8"),
        ("cook-torance-n4", "cook-torrance-n4"),
    ] {
        let output = folder.run(&format!("recipes get {given}"));
        assert_eq!(output.status.code(), Some(2));
        let message = String::from_utf8_lossy(&output.stderr);
        let suggested = format!("'{meant}'");
        assert!(
            message.contains(&suggested) && message.contains(given),
            "{message}"
        );
    }
    // A shell completes them.
    let script = folder.succeed("completion bash");
    for bundled in bundled::ALL {
        assert!(script.contains(bundled.name), "{}", bundled.name);
    }
}

#[test]
fn the_list_is_json_too() {
    let list = Folder::new().succeed_as_json("recipes list");
    let list = list.as_array().expect("a list");
    assert_eq!(list.len(), bundled::ALL.len());
    for (entry, bundled) in list.iter().zip(bundled::ALL) {
        let recipe = bundled.recipe().expect("it is whole");
        let losses = bundled.losses().expect("they were measured");
        let expected = json!({
            "name": bundled.name,
            "model": recipe.model().name(),
            "samples": recipe.samples(),
            "takes_missing": recipe.tolerates_missing(),
            "checksum": format!("{:08x}", recipe.checksum()),
            "bytes": bundled.bytes.len(),
            "basis_bytes": bundled.basis().map(<[u8]>::len),
            "loss": {
                "procedural": losses.procedural,
                "merl": losses.merl,
                "rgl": losses.rgl,
            },
        });
        assert_eq!(*entry, expected);
    }
}

/// A file that is not a recipe is not read to its end, since it may not end.
#[cfg(target_os = "linux")]
#[test]
fn what_has_no_end_is_refused_by_name() {
    use std::process::Command;

    let folder = Folder::new();
    folder.succeed("recipes get linear-n1");
    let huge = fs::File::create(folder.at("huge.hdr")).expect("a file");
    huge.set_len(1 << 40).expect("it is sparse");
    for (command, file) in [
        ("inspect /dev/zero", "/dev/zero"),
        ("plan /dev/zero", "/dev/zero"),
        ("export /dev/zero --format json --out x", "/dev/zero"),
        (
            "render view linear-n1.recipe --material procedural:1 --basis /dev/zero",
            "/dev/zero",
        ),
        (
            "evaluate --recipe linear-n1.recipe --test procedural:1 --basis /dev/zero",
            "/dev/zero",
        ),
        (
            "render sphere procedural:1 --environment huge.hdr",
            "huge.hdr",
        ),
        ("query procedural:1 --angles /dev/zero", "/dev/zero"),
        ("query /dev/zero --angles x", "x"),
    ] {
        // A gigabyte of addresses, threads and all.
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
