//! What is written, and what is left alone.

use std::fs;
use std::path::Path;
use std::thread::sleep;
use std::time::Duration;

use super::common::assert_names;
use super::survival::start;
use super::{TRAIN, fail, fail_naming, succeed, succeed_as_json, trainer};

const RECIPE: &[u8] = include_bytes!("../../../core/examples/recipes/phong-n8.recipe");
const OTHER: &[u8] = include_bytes!("../../../core/examples/recipes/neural-n8.recipe");

/// A folder with a recipe in it.
fn folder() -> tempfile::TempDir {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    fs::write(scratch.path().join("r.recipe"), RECIPE).expect("it is written");
    scratch
}

fn export<'a>(format: &'a str, out: &'a str) -> [&'a str; 6] {
    ["export", "r.recipe", "--format", format, "--out", out]
}

#[cfg(unix)]
#[test]
fn what_is_no_regular_file_is_written_to_and_not_replaced() {
    use std::os::unix::fs::{FileTypeExt, symlink};
    use std::process::Command;

    let scratch = folder();
    let at = |name: &str| scratch.path().join(name);
    // By a link: a defect shall not cost this machine its device.
    symlink("/dev/full", at("full")).expect("it is linked");
    fail_naming(scratch.path(), &export("json", "full"), &["full"]);
    assert!(at("full").is_symlink());
    let device = fs::metadata(at("full")).expect("it is there");
    assert!(device.file_type().is_char_device());

    let printed = succeed_as_json(scratch.path(), &export("json", "/dev/fd/1"));
    assert_eq!(printed["inner_steps"], 20);

    let made = Command::new("mkfifo").arg(at("pipe")).status();
    assert!(made.expect("mkfifo runs").success());
    let mut run = start(scratch.path(), &export("postcard", "pipe"));
    assert_eq!(fs::read(at("pipe")).expect("it is read"), RECIPE);
    assert!(run.wait().expect("it ends").success());
    let pipe = fs::metadata(at("pipe")).expect("it is there");
    assert!(pipe.file_type().is_fifo());

    // What has to lie beside a recipe cannot lie beside a device.
    symlink("/dev/null", at("null")).expect("it is linked");
    for (model, option) in [("phong", "--checkpoint"), ("linear", "basis")] {
        let arguments = ["train", "--model", model, "--samples", "1", "--out", "null"];
        fail_naming(scratch.path(), &arguments, &["null", option]);
    }
}

#[cfg(unix)]
#[test]
fn links_are_followed_and_read_only_files_left_alone() {
    use std::os::unix::fs::{PermissionsExt, symlink};

    let scratch = folder();
    let at = |name: &str| scratch.path().join(name);
    symlink("real.json", at("link.json")).expect("it is linked");
    for _ in 0..2 {
        succeed(scratch.path(), &export("json", "link.json"));
        assert!(at("link.json").is_symlink() && !at("real.json").is_symlink());
        assert!(at("real.json").is_file());
    }

    fs::write(at("kept.json"), "kept").expect("it is written");
    fs::set_permissions(at("kept.json"), PermissionsExt::from_mode(0o444)).expect("it is set");
    for out in ["kept.json", "link.json"] {
        if out == "link.json" {
            fs::remove_file(at(out)).expect("it is removed");
            symlink("kept.json", at(out)).expect("it is linked");
        }
        fail_naming(scratch.path(), &export("json", out), &[out]);
    }
    assert_eq!(fs::read(at("kept.json")).expect("it is there"), b"kept");
}

/// The six files of a network of zeros.
fn write_network(directory: &Path, name: &str) {
    for (array, shape, count) in [
        ("fc1", "6, 21", 126),
        ("b1", "21,", 21),
        ("fc2", "21, 21", 441),
        ("b2", "21,", 21),
        ("fc3", "21, 3", 63),
        ("b3", "3,", 3),
    ] {
        let mut header =
            format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({shape}), }}");
        while (10 + header.len() + 1) % 64 != 0 {
            header.push(' ');
        }
        header.push('\n');
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.bytes());
        bytes.resize(bytes.len() + 4 * count, 0);
        let file = directory.join(format!("{name}_{array}.npy"));
        fs::write(file, bytes).expect("it is written");
    }
}

#[test]
fn what_is_read_is_not_written_over() {
    let scratch = folder();
    let at = |name: &str| scratch.path().join(name);
    fs::write(at("r.basis"), "a basis").expect("it is written");
    fs::write(at("r.svg"), RECIPE).expect("it is written");
    fs::write(at("e.exr"), "a panorama").expect("it is written");
    fs::write(at("a.csv"), "theta_h,theta_d,phi_d\n1,2,3\n").expect("it is written");
    fs::create_dir(at("materials")).expect("it is made");
    write_network(&at("materials"), "felt");
    let sphere = ["render", "sphere", "procedural:1", "--environment", "e.exr"];
    let query = ["query", "procedural:1", "--angles", "a.csv"];
    let folder = ["query", "materials", "--angles", "a.csv"];
    let file = ["query", "materials/felt_b3.npy", "--angles", "a.csv"];
    let lobe = ["render", "lobe", "procedural:1", "--recipe", "r.svg"];
    let scanner = [
        "virtual-scanner",
        "--material",
        "procedural:1",
        "--recipe",
        "r.recipe",
    ];
    let material = ["virtual-scanner", "--material", "materials/felt_b1.npy"];
    for (command, out) in [
        (
            &["export", "r.recipe", "--format", "postcard"][..],
            "r.recipe",
        ),
        (&["export", "r.recipe", "--format", "json"], "./r.recipe"),
        (&["export", "r.recipe", "--format", "basis"], "r.basis"),
        (&["render", "pattern", "r.svg"], "r.svg"),
        (&lobe, "r.svg"),
        (&sphere, "e.exr"),
        (&query, "a.csv"),
        (&folder, "materials/felt_fc2.npy"),
        (&file, "materials/felt_fc1.npy"),
        (&scanner, "r.recipe"),
        (&scanner, "r.basis"),
        (&material, "materials/felt_b3.npy"),
    ] {
        let before = fs::read(at(out)).expect("it is there");
        fail_naming(scratch.path(), &[command, &["--out", out]].concat(), &[out]);
        assert_eq!(fs::read(at(out)).expect("it is there"), before);
    }
    // A scanner says so before it waits for a device, whose scan would be lost.
    fs::copy(at("r.recipe"), at("other.recipe")).expect("it is copied");
    for (out, named) in [("no/x.json", "no"), ("other.recipe", "other.recipe")] {
        let listen = ["--listen", "127.0.0.1:0", "--out", out];
        fail_naming(scratch.path(), &[&material[..], &listen].concat(), &[named]);
    }
    // Beside what is read it may be.
    succeed(
        scratch.path(),
        &[&folder[..], &["--out", "materials/felt.csv"]].concat(),
    );
}

#[test]
fn no_folder_is_made_above_the_one_that_is_named() {
    let scratch = folder();
    let mut train = TRAIN.to_vec();
    train[10] = "nope/phong.recipe";
    let mut checkpoint = TRAIN.to_vec();
    checkpoint.extend(["--checkpoint", "nope/deeper"]);
    for arguments in [
        &export("json", "nope/x")[..],
        &["render", "pattern", "r.recipe", "--out", "nope/p.svg"],
        &[
            "render",
            "sphere",
            "procedural:1",
            "--size",
            "8",
            "--out",
            "nope/s.png",
        ],
        &["quickstart", "--out", "nope/deeper"],
        &["reproduce", "bases", "--out", "nope/deeper"],
        &["train", "--grid", "--out", "nope/deeper"],
        &train,
        &checkpoint,
    ] {
        fail_naming(scratch.path(), arguments, &["nope"]);
        assert!(!scratch.path().join("nope").exists(), "{arguments:?}");
    }
}

#[test]
fn what_took_hours_stays_until_it_is_told_to_go() {
    let scratch = folder();
    let at = |name: &str| scratch.path().join(name);
    let write = |name: &str, bytes: &[u8]| fs::write(at(name), bytes).expect("it is written");
    let refuse = |arguments: &[&str], name: &str| {
        let before = fs::read(at(name)).expect("it is there");
        fail_naming(scratch.path(), arguments, &["--force", name]);
        assert_eq!(fs::read(at(name)).expect("it is there"), before);
    };

    // Of another training.
    write("phong.recipe", OTHER);
    refuse(&TRAIN, "phong.recipe");
    refuse(&[&TRAIN[..], &["--resume"]].concat(), "phong.recipe");
    // No recipe at all.
    write("phong.recipe", b"a letter");
    refuse(&TRAIN, "phong.recipe");
    fs::remove_file(at("phong.recipe")).expect("it is removed");

    // The basis of another recipe, such as linear.old.
    let mut linear = TRAIN.to_vec();
    (linear[2], linear[10]) = ("linear", "linear.recipe");
    write("linear.basis", b"a basis");
    refuse(&linear, "linear.basis");

    // A run that was stopped.
    fs::create_dir(at("phong.recipe.checkpoint")).expect("it is made");
    write("phong.recipe.checkpoint/checkpoint.bin", b"hours");
    let remedies = ["phong.recipe.checkpoint", "--resume", "--force"];
    fail_naming(scratch.path(), &TRAIN, &remedies);
    let kept = fs::read(at("phong.recipe.checkpoint/checkpoint.bin")).expect("it is there");
    assert_eq!(kept, b"hours");
    succeed(scratch.path(), &[&TRAIN[..], &["--force"]].concat());
    assert!(!at("phong.recipe.checkpoint").exists());

    // An export over another recipe; over the same one nothing is lost.
    write("other.recipe", OTHER);
    refuse(&export("postcard", "other.recipe"), "other.recipe");
    refuse(&export("json", "other.recipe"), "other.recipe");
    write("same.recipe", RECIPE);
    succeed(scratch.path(), &export("postcard", "same.recipe"));
    let forced = [&export("postcard", "other.recipe")[..], &["--force"]].concat();
    succeed(scratch.path(), &forced);
    assert_eq!(fs::read(at("other.recipe")).expect("it is there"), RECIPE);

    // The first command that anybody types.
    fs::create_dir(at("recipes")).expect("it is made");
    write("recipes/neural-n8.recipe", RECIPE);
    let message = fail(scratch.path(), &["quickstart", "--out", "recipes"]);
    assert!(message.contains("neural-n8.recipe"), "{message}");
    assert_eq!(
        fs::read(at("recipes/neural-n8.recipe")).expect("it is there"),
        RECIPE
    );
    assert!(!at("recipes/index.html").exists());

    // Commands that have no --force name another remedy.
    write("a.csv", b"theta_h,theta_d,phi_d\n1,2,3\n");
    write("kept", OTHER);
    let query = [
        "query",
        "procedural:1",
        "--angles",
        "a.csv",
        "--out",
        "kept",
    ];
    fail_naming(scratch.path(), &query, &["kept"]);
    assert_eq!(fs::read(at("kept")).expect("it is there"), OTHER);
}

#[test]
fn two_runs_do_not_write_the_same() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let long = [
        "train",
        "--model",
        "neural",
        "--samples",
        "64",
        "--data",
        "procedural:20",
        "--effort",
        "long",
        "--checkpoint-every",
        "0",
        "--out",
        "n.recipe",
    ];
    let wait_for = |name: &str| {
        while !scratch.path().join(name).exists() {
            sleep(Duration::from_millis(5));
        }
    };
    let mut first = start(scratch.path(), &long);
    wait_for("n.recipe.checkpoint/checkpoint.bin");
    for more in [
        &[][..],
        &["--resume"],
        &["--force"],
        &["--checkpoint", "elsewhere"],
    ] {
        let message = fail(scratch.path(), &[&long[..], more].concat());
        assert_names(&message, &["n.recipe", "n.recipe.lock"]);
    }
    // Another recipe by way of the same checkpoint.
    let mut other = long.to_vec();
    other[12] = "other.recipe";
    other.extend(["--checkpoint", "n.recipe.checkpoint"]);
    fail_naming(scratch.path(), &other, &["n.recipe.checkpoint.lock"]);
    assert!(first.try_wait().expect("it runs").is_none(), "it ended");
    first.kill().expect("it is killed");
    first.wait().expect("it ends");
    assert!(
        scratch
            .path()
            .join("n.recipe.checkpoint/checkpoint.bin")
            .exists()
    );
    // What was killed holds nothing any more.
    let message = fail(scratch.path(), &long);
    assert_names(&message, &["n.recipe.checkpoint", "--resume"]);
    assert!(!message.contains(".lock"), "{message}");

    let grid = [
        "train", "--grid", "--model", "neural", "--effort", "long", "--out", "grid",
    ];
    let mut first = start(scratch.path(), &grid);
    wait_for("grid/neural-n1.recipe.lock");
    fail_naming(scratch.path(), &grid, &["grid/run.lock"]);
    let alone = [
        "train",
        "--model",
        "neural",
        "--samples",
        "1",
        "--out",
        "grid/neural-n1.recipe",
    ];
    fail_naming(scratch.path(), &alone, &["grid/neural-n1.recipe.lock"]);
    let bases = ["reproduce", "bases", "--out", "grid"];
    fail_naming(scratch.path(), &bases, &["grid/run.lock"]);
    first.kill().expect("it is killed");
    first.wait().expect("it ends");
}

#[test]
fn a_file_where_a_directory_is_needed_is_named() {
    let scratch = folder();
    let at = |name: &str| scratch.path().join(name);
    fs::write(at("file"), "kept").expect("it is written");
    fs::write(
        at("a.csv"),
        "index,value\n0,1\n1,1\n2,1\n3,1\n4,1\n5,1\n6,1\n7,1\n",
    )
    .expect("written");
    let fit = ["fit", "r.recipe", "--measurements", "a.csv"];
    for command in [
        &["recipes", "get", "phong-n1"][..],
        &["quickstart"],
        &["train", "--grid"],
        &["reproduce", "bases"],
        &fit,
    ] {
        for out in ["file", "file/deeper"] {
            let output = trainer(scratch.path(), &[command, &["--out", out]].concat());
            let message = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), Some(1), "{command:?}: {message}");
            assert!(message.contains("file"), "{command:?}: {message}");
            assert!(!message.contains("os error"), "{command:?}: {message}");
        }
    }
    let message = fail(scratch.path(), &export("json", "file/x.json"));
    assert!(
        message.contains("file/x.json") && !message.contains("os error"),
        "{message}"
    );
    assert_eq!(fs::read(at("file")).expect("it is there"), b"kept");
}
