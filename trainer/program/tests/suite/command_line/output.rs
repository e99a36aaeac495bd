//! Output files, and files that commands must not overwrite.

use std::fs;
use std::thread::sleep;
use std::time::Duration;

use super::Folder;
use super::folder::{NEURAL_N8, PHONG_N8};
use super::shared::TRAIN;
use crate::common::assert_names;

/// Readings of eight samples.
const READINGS: &str = "index,value\n0,0.2\n1,0.1\n2,0.1\n3,0.1\n4,0.1\n5,0.1\n6,0.1\n7,0.1\n";

/// A folder with a recipe.
fn folder() -> Folder {
    Folder::with("r.recipe", PHONG_N8)
}

fn export(format: &str, out: &str) -> String {
    format!("export r.recipe --format {format} --out {out}")
}

#[cfg(unix)]
#[test]
fn writes_to_pipes_and_devices() {
    use std::os::unix::fs::{FileTypeExt, symlink};
    use std::process::Command;

    let folder = folder();
    let file_type = |name| fs::metadata(folder.at(name)).map(|file| file.file_type());
    // Through a link, so that a defect cannot remove this machine's device.
    symlink("/dev/full", folder.at("full")).expect("the link is created");
    folder.fail_naming(&export("json", "full"), &["full"]);
    assert!(folder.at("full").is_symlink());
    assert!(file_type("full").expect("the file exists").is_char_device());

    let printed = folder.succeed(&export("json", "/dev/fd/1"));
    let printed: serde_json::Value = serde_json::from_str(&printed).expect("valid JSON");
    assert_eq!(printed["sgd"]["steps"], 20);

    let status = Command::new("mkfifo").arg(folder.at("pipe")).status();
    assert!(status.expect("mkfifo runs").success());
    let mut run = folder.start(&export("postcard", "pipe"));
    assert_eq!(folder.read("pipe"), PHONG_N8);
    assert!(run.wait().expect("the process ends").success());
    assert!(file_type("pipe").expect("the file exists").is_fifo());

    // A checkpoint cannot be next to a device.
    symlink("/dev/null", folder.at("null")).expect("the link is created");
    folder.fail_naming("train --model phong --samples 1 --out null", &["null"]);
}

#[test]
fn rejects_output_that_is_an_input() {
    let folder = folder();
    folder.write("r.basis", "a basis");
    folder.write("r.svg", PHONG_N8);
    folder.write("n.recipe", NEURAL_N8);
    folder.write("m.csv", READINGS);
    folder.write("a.csv", "theta_h,theta_d,phi_d\n1,2,3\n");
    fs::create_dir(folder.at("materials")).expect("the folder is created");
    let network = "fit n.recipe --measurements m.csv --format nbrdf --out fitted";
    folder.succeed(network);
    for array in ["fc1", "b1", "fc2", "b2", "fc3", "b3"] {
        let from = folder.at(&format!("fitted/formats/m_{array}.npy"));
        let to = folder.at(&format!("materials/felt_{array}.npy"));
        fs::rename(from, to).expect("the file is moved");
    }
    let material = "virtual-scanner --material materials/felt_b1.npy";
    let scanner = "virtual-scanner --material procedural:1 --recipe r.recipe";
    for (command, out) in [
        ("export r.recipe --format postcard", "r.recipe"),
        ("export r.recipe --format json", "./r.recipe"),
        ("export r.recipe --format basis", "r.basis"),
        ("render pattern r.svg", "r.svg"),
        ("plan r.recipe --force", "r.recipe"),
        ("query procedural:1 --angles a.csv", "a.csv"),
        ("query materials --angles a.csv", "materials/felt_fc2.npy"),
        (
            "query materials/felt_b3.npy --angles a.csv",
            "materials/felt_fc1.npy",
        ),
        (scanner, "r.recipe"),
        (scanner, "r.basis"),
        (material, "materials/felt_b3.npy"),
    ] {
        let before = folder.read(out);
        folder.fail_naming(&format!("{command} --out {out}"), &[out]);
        assert_eq!(folder.read(out), before, "{command}");
    }
    // The virtual scanner fails before it waits for a device, whose scan would be lost.
    folder.fail_naming(
        &format!("{material} --listen 127.0.0.1:0 --out no/x.json"),
        &["no"],
    );
    // The folder of an input is allowed.
    folder.succeed("query materials --angles a.csv --out materials/felt.csv");
}

#[test]
fn replaces_valuable_files_only_with_force() {
    let folder = folder();
    let refuse = |command: &str, name: &str| {
        let before = folder.read(name);
        folder.fail_naming(command, &["--force", name]);
        assert_eq!(folder.read(name), before);
    };

    // A recipe of another training.
    folder.write("phong.recipe", NEURAL_N8);
    refuse(TRAIN, "phong.recipe");
    refuse(&format!("{TRAIN} --resume"), "phong.recipe");
    // A file that is not a recipe.
    folder.write("phong.recipe", b"a letter");
    refuse(TRAIN, "phong.recipe");
    fs::remove_file(folder.at("phong.recipe")).expect("the file is removed");

    // The basis of another recipe.
    folder.write("linear.basis", b"a basis");
    refuse(&TRAIN.replace("phong", "linear"), "linear.basis");

    // An unfinished run.
    let checkpoint = "phong.recipe.checkpoint/checkpoint.bin";
    fs::create_dir(folder.at("phong.recipe.checkpoint")).expect("the folder is created");
    folder.write(checkpoint, b"hours");
    folder.fail_naming(TRAIN, &["phong.recipe.checkpoint", "--resume", "--force"]);
    assert_eq!(folder.read(checkpoint), b"hours");
    folder.succeed(&format!("{TRAIN} --force"));
    assert!(!folder.exists("phong.recipe.checkpoint"));

    // An export over another file. Exporting over the same file is allowed.
    folder.write("other", NEURAL_N8);
    refuse(&export("postcard", "other"), "other");
    folder.write("same", PHONG_N8);
    folder.succeed(&export("postcard", "same"));
    folder.succeed(&export("postcard", "other --force"));
    assert_eq!(folder.read("other"), PHONG_N8);

    // All other commands with an output.
    folder.write("a.csv", b"theta_h,theta_d,phi_d\n1,2,3\n");
    fs::create_dir(folder.at("q")).expect("the folder is created");
    for (command, out) in [
        ("quickstart --out q", "q/neural-n8.recipe"),
        ("plan r.recipe --out plan.csv", "plan.csv"),
        ("plan r.recipe --blank sheet.csv", "sheet.csv"),
        ("query procedural:1 --angles a.csv --out kept", "kept"),
        ("render pattern r.recipe --out kept.svg", "kept.svg"),
        ("render sphere procedural:1 --size 8 --out s.png", "s.png"),
        (
            "render view r.recipe --material procedural:1 --out s.html",
            "s.html",
        ),
        (
            "virtual-scanner --material procedural:1 --listen 127.0.0.1:0 --out s.json",
            "s.json",
        ),
    ] {
        folder.write(out, b"kept");
        refuse(command, out);
    }
    assert!(!folder.exists("q/index.html"));
}

#[test]
fn concurrent_runs_cannot_write_same_output() {
    let folder = Folder::new();
    let wait_for = |name: &str| {
        while !folder.exists(name) {
            sleep(Duration::from_millis(5));
        }
    };
    let long = "train --model neural --samples 64 --data procedural:20 --effort long \
                --out n.recipe";
    let mut first = folder.start(long);
    wait_for("n.recipe.checkpoint/checkpoint.bin");
    for more in ["", "--resume", "--force"] {
        folder.fail_naming(&format!("{long} {more}"), &["n.recipe", "n.recipe.lock"]);
    }
    assert!(
        first.try_wait().expect("the process runs").is_none(),
        "the process ended early"
    );
    first.kill().expect("the process is killed");
    first.wait().expect("the process ends");
    assert!(folder.exists("n.recipe.checkpoint/checkpoint.bin"));
    // A killed run does not hold its lock.
    let message = folder.fail(long);
    assert_names(&message, &["n.recipe.checkpoint", "--resume"]);
    assert!(!message.contains(".lock"), "{message}");
}

#[test]
fn rejects_missing_parent_folder_and_file_in_its_place() {
    let folder = folder();
    for command in [
        &export("json", "missing/x")[..],
        "render pattern r.recipe --out missing/p.svg",
        "render sphere procedural:1 --size 8 --out missing/s.png",
        "quickstart --out missing/deeper",
        "reproduce bases --out missing/deeper",
        &TRAIN.replace("phong.recipe", "missing/phong.recipe"),
    ] {
        folder.fail_naming(command, &["missing"]);
        assert!(!folder.exists("missing"), "{command}");
    }
    folder.write("file", "kept");
    folder.write("a.csv", READINGS);
    let assert_fails_naming = |command: &str, name: &str| {
        let output = folder.run(command);
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{command}: {message}");
        assert!(message.contains(name), "{command}: {message}");
        assert!(!message.contains("os error"), "{command}: {message}");
    };
    for command in [
        "recipes get phong-n1",
        "quickstart",
        "reproduce bases",
        "fit r.recipe --measurements a.csv",
    ] {
        for out in ["file", "file/deeper"] {
            assert_fails_naming(&format!("{command} --out {out}"), "file");
        }
    }
    assert_fails_naming(&export("json", "file/x.json"), "file/x.json");
    assert_eq!(folder.read("file"), b"kept");
}
