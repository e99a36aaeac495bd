//! Materials from one format to another.

use std::fs;

use serde_json::{Value, json};

use super::common::assert_names;
use super::{fail, succeed};

/// The loss that a conversion comes to: the number in what it prints.
fn loss(printed: &str) -> f64 {
    let number = printed.split_whitespace().last();
    number.expect("a number").parse().expect("it is a number")
}

#[test]
fn a_material_goes_from_format_to_format() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let run = |arguments: &[&str]| loss(&succeed(scratch.path(), arguments));
    let bytes = |name: &str| fs::read(scratch.path().join(name)).expect("it is there");
    let table = run(&["convert", "procedural:1:3", "made.binary"]);
    assert!(table < 0.005, "{table}");
    let tensors = run(&["convert", "made.binary", "made_rgb.bsdf"]);
    assert!(tensors < 0.002, "{tensors}");
    // Its own format is copied, also where the name does not tell it.
    assert_eq!(
        run(&["convert", "made.binary", "copy", "--format", "merl"]),
        0.0
    );
    assert_eq!(bytes("copy"), bytes("made.binary"));
    assert_eq!(run(&["convert", "copy", "again.binary"]), 0.0);

    let text = run(&["convert", "made.binary", "made", "--format", "pab"]);
    assert!(text < 0.2, "{text}");
    let again = run(&["convert", "made_in30.txt", "text.bsdf"]);
    assert!(again < 0.002, "{again}");

    let network = run(&["convert", "made_rgb.bsdf", "net", "--format", "nbrdf"]);
    assert!(network < 0.02, "{network}");
    let names = ["fc1", "b1", "fc2", "b2", "fc3", "b3"];
    for name in names {
        assert!(bytes(&format!("net_{name}.npy")).starts_with(b"\x93NUMPY"));
    }
    assert_eq!(run(&["convert", "net_b1.npy", "other_fc3.npy"]), 0.0);
    for name in names {
        assert_eq!(
            bytes(&format!("net_{name}.npy")),
            bytes(&format!("other_{name}.npy"))
        );
    }
}

#[test]
fn what_cannot_be_meant_is_refused() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let at = |name: &str| scratch.path().join(name);
    succeed(
        scratch.path(),
        &["convert", "procedural:1:3", "made_rgb.bsdf"],
    );
    let before = fs::read(at("made_rgb.bsdf")).expect("it is there");
    for (arguments, named) in [
        (
            &["convert", "procedural:2", "made.binary"][..],
            &["procedural:2", "2"][..],
        ),
        (
            &["convert", "procedural:1", "made"],
            &["made", "--format", ".binary", ".bsdf"],
        ),
        (
            &["convert", "procedural:1", "made.binary", "--format", "rgl"],
            &["made.binary", "--format", "merl"],
        ),
        (&["convert", "procedural:1", "made.npy"], &["made.npy"]),
        (
            &["convert", "made_rgb.bsdf", "made_rgb.bsdf"],
            &["made_rgb.bsdf"],
        ),
        (
            &["convert", "procedural:1", "made_rgb.bsdf"],
            &["made_rgb.bsdf", "--force"],
        ),
        (&["convert", "procedural:1", "none/made.binary"], &["none"]),
    ] {
        assert_names(&fail(scratch.path(), arguments), named);
    }
    let names = fs::read_dir(scratch.path()).expect("it can be listed");
    assert_eq!(names.count(), 1, "something was written");
    assert_eq!(fs::read(at("made_rgb.bsdf")).expect("it is there"), before);
    succeed(
        scratch.path(),
        &["convert", "procedural:1", "made_rgb.bsdf", "--force"],
    );
    assert_ne!(fs::read(at("made_rgb.bsdf")).expect("it is there"), before);
}

#[test]
fn what_was_written_is_reported_as_json() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let run = |arguments: &[&str]| {
        let text = succeed(scratch.path(), &[arguments, &["--json"]].concat());
        serde_json::from_str::<Value>(&text).expect("it is JSON")
    };
    let made = run(&["convert", "procedural:1:3", "made.binary"]);
    assert_eq!(
        (&made["format"], &made["copied"]),
        (&"merl".into(), &false.into())
    );
    assert_eq!(made["material"], "procedural-3-000-metal");
    let size = fs::metadata(scratch.path().join("made.binary")).expect("it is there");
    assert_eq!(
        made["files"],
        json!([{ "path": "made.binary", "bytes": size.len() }])
    );
    assert!(made["loss"].as_f64().is_some_and(|loss| loss < 0.005));
    let text = run(&["convert", "made.binary", "made", "--format", "pab"]);
    assert_eq!(text["files"].as_array().map(Vec::len), Some(11));
    let copy = run(&["convert", "made.binary", "copy.binary"]);
    assert_eq!(
        (&copy["copied"], &copy["loss"]),
        (&true.into(), &0.0.into())
    );
}
