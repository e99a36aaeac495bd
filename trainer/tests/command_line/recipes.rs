//! `trainer recipes`: what comes along.

use std::fs;

use glimpse_kernels::lanes::InstructionSet;
use glimpse_trainer::shipped;

use super::{fail_naming, succeed, succeed_as_json};

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
    fail_naming(
        directory,
        &["recipes", "get", "neural-n3"],
        &["neural-n3", "list"],
    );

    fs::write(directory.join("mine/phong-n1.recipe"), neural.bytes).expect("a file");
    fail_naming(
        directory,
        &["recipes", "get", "phong-n1", "--out", "mine"],
        &["mine/phong-n1.recipe", "--force"],
    );
}

/// By the options that the folder of recipes names; other instructions leave other bits.
#[test]
fn a_recipe_that_comes_along_is_made_again_bit_for_bit() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    let train = [
        "train",
        "--model",
        "phong",
        "--samples",
        "1",
        "--effort",
        "quick",
    ];
    let data = [
        "--data",
        "procedural:400",
        "--noise",
        "0.02",
        "--min-separation",
        "10",
    ];
    let limits = [
        "--max-theta-i",
        "80",
        "--max-theta-o",
        "80",
        "--out",
        "made.recipe",
    ];
    succeed(directory, &[&train[..], &data, &limits].concat());
    let export = ["export", "made.recipe", "--format", "postcard", "--strip"];
    succeed(
        directory,
        &[&export[..], &["--out", "stripped.recipe"]].concat(),
    );
    let made = fs::read(directory.join("stripped.recipe")).expect("it was written");
    let shipped = shipped::find("phong-n1").expect("it comes along");
    match InstructionSet::of_this_machine() {
        InstructionSet::Avx512 => assert!(made == shipped.bytes),
        _ => assert_eq!(made.len(), shipped.bytes.len()),
    }
}
