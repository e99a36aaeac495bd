//! `trainer recipes`: what comes along.

use std::fs;

use glimpse_trainer::shipped;

use serde_json::{Value, json};

use super::{fail_naming, succeed, succeed_as_json, trainer};

#[test]
fn recipes_that_come_along_are_listed_written_and_used() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    let list = succeed(directory, &["recipes", "list"]);
    for shipped in shipped::ALL {
        let there = list.lines().any(|line| line.starts_with(shipped.name));
        assert!(there, "{} in {list}", shipped.name);
    }

    let get = ["recipes", "get", "linear-n8", "neural-n16-masked"];
    succeed(directory, &[&get[..], &["--out", "mine"]].concat());
    let written = |name: &str| fs::read(directory.join("mine").join(name)).expect("it was written");
    assert_eq!(written("linear-n8.basis"), shipped::BASIS);
    let neural = shipped::find("neural-n16-masked").expect("it comes along");
    assert_eq!(written("neural-n16-masked.recipe"), neural.bytes);

    // The compact basis serves wherever a whole one does. (That it is a device's is tested beside core.)
    let evaluate = ["evaluate", "--test", "procedural:2:5", "--json", "--recipe"];
    let judged = succeed_as_json(
        directory,
        &[&evaluate[..], &["mine/linear-n8.recipe"]].concat(),
    );
    let loss = judged["loss"].as_f64().expect("a mean loss");
    assert!(loss < 0.005, "{loss}");

    let view = [
        "render",
        "view",
        "mine/linear-n8.recipe",
        "--out",
        "view.html",
    ];
    succeed(
        directory,
        &[&view[..], &["--material", "procedural:1:77"]].concat(),
    );
    assert!(directory.join("view.html").is_file());

    let again = [
        "export",
        "mine/linear-n8.recipe",
        "--format",
        "basis",
        "--out",
        "x.basis",
    ];
    fail_naming(directory, &again, &["mine/linear-n8.basis"]);
    fail_naming(directory, &["recipes", "get", "neural-n3"], &["neural-n3"]);

    fs::write(directory.join("mine/phong-n1.recipe"), neural.bytes).expect("a file");
    fail_naming(
        directory,
        &["recipes", "get", "phong-n1", "--out", "mine"],
        &["mine/phong-n1.recipe", "--force"],
    );
}

#[test]
fn a_name_that_is_almost_right_is_suggested() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    for (given, meant) in [
        ("linear-n16-maskd", "linear-n16-masked"),
        ("masked-n16", "linear-n16-masked"),
        ("masked-n16", "neural-n16-masked"),
        ("nural-n8", "neural-n8"),
        ("cook-torance-n4", "cook-torrance-n4"),
    ] {
        let output = trainer(scratch.path(), &["recipes", "get", given]);
        assert_eq!(output.status.code(), Some(2));
        let message = String::from_utf8_lossy(&output.stderr);
        let suggested = format!("'{meant}'");
        assert!(
            message.contains(&suggested) && message.contains(given),
            "{message}"
        );
    }
    // A shell completes them.
    let script = succeed(scratch.path(), &["completion", "bash"]);
    for shipped in shipped::ALL {
        assert!(script.contains(shipped.name), "{}", shipped.name);
    }
}

#[test]
fn the_list_is_json_too() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let list = succeed(scratch.path(), &["recipes", "list", "--json"]);
    let list: Value = serde_json::from_str(&list).expect("it is JSON");
    let list = list.as_array().expect("a list");
    assert_eq!(list.len(), shipped::ALL.len());
    for (entry, shipped) in list.iter().zip(shipped::ALL) {
        let recipe = shipped.recipe().expect("it is whole");
        let losses = shipped.losses().expect("they were measured");
        let expected = json!({
            "name": shipped.name,
            "model": recipe.model().name(),
            "samples": recipe.samples(),
            "takes_missing": recipe.learner().takes_missing(),
            "checksum": format!("{:08x}", recipe.checksum()),
            "bytes": shipped.bytes.len(),
            "basis_bytes": shipped.basis().map(<[u8]>::len),
            "loss": {
                "procedural": losses.procedural,
                "merl": losses.merl,
                "rgl": losses.rgl,
            },
        });
        assert_eq!(*entry, expected);
    }
}

/// What is no recipe is not read to its end, which it may not have.
#[cfg(target_os = "linux")]
#[test]
fn what_has_no_end_is_refused_by_name() {
    use std::process::Command;

    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    succeed(directory, &["recipes", "get", "linear-n1"]);
    let huge = fs::File::create(directory.join("huge.hdr")).expect("a file");
    huge.set_len(1 << 40).expect("it is sparse");
    let zero = "/dev/zero";
    let view = [
        "render",
        "view",
        "linear-n1.recipe",
        "--material",
        "procedural:1",
    ];
    let evaluate = [
        "evaluate",
        "--recipe",
        "linear-n1.recipe",
        "--test",
        "procedural:1",
    ];
    let sphere = ["render", "sphere", "procedural:1", "--environment"];
    for (command, file) in [
        (&["inspect", zero][..], zero),
        (&["plan", zero], zero),
        (&["export", zero, "--format", "json", "--out", "x"], zero),
        (&[&view[..], &["--basis", zero]].concat(), zero),
        (&[&evaluate[..], &["--basis", zero]].concat(), zero),
        (&[&sphere[..], &["huge.hdr"]].concat(), "huge.hdr"),
        (&["query", "procedural:1", "--angles", zero], zero),
        (&["query", zero, "--angles", "x"], "x"),
    ] {
        // A gigabyte of addresses, threads and all.
        let output = Command::new("sh")
            .args(["-c", "ulimit -v 2000000 && exec \"$0\" \"$@\""])
            .arg(env!("CARGO_BIN_EXE_trainer"))
            .args(command)
            .current_dir(directory)
            .output()
            .expect("a shell runs");
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{command:?}: {message}");
        assert!(message.contains(file), "{command:?}: {message}");
    }
}
