//! `trainer recipes`: what comes along.

use std::fs;

use glimpse_kernels::lanes::InstructionSet;
use glimpse_trainer::shipped;

use super::{fail, succeed};

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
    let evaluate = ["evaluate", "--test", "procedural:2:5", "--recipe"];
    let judged = succeed(
        directory,
        &[&evaluate[..], &["mine/linear-n8.recipe"]].concat(),
    );
    let mean = judged.lines().find(|line| line.starts_with("mean "));
    let loss = mean.and_then(|line| line.split_whitespace().nth(1));
    let loss: f64 = loss
        .and_then(|word| word.parse().ok())
        .expect("a mean loss");
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
    let told = fail(directory, &again);
    assert!(told.contains("is a compact basis already"), "{told}");
    let told = fail(directory, &["recipes", "get", "neural-n3"]);
    assert!(
        told.contains("there is no recipe `neural-n3`: `trainer recipes list`"),
        "{told}"
    );

    fs::write(directory.join("mine/phong-n1.recipe"), neural.bytes).expect("a file");
    let told = fail(directory, &["recipes", "get", "phong-n1", "--out", "mine"]);
    assert!(
        told.contains("a recipe that would be lost: give --force"),
        "{told}"
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
