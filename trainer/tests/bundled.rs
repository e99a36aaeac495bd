//! The instructions in `recipes/README.md` reproduce a bundled recipe. `tests/run bundled` runs this test.

use std::fs;
use std::path::Path;
use std::process::Command;

use glimpse_kernels::lanes::InstructionSet;
use glimpse_trainer::bundled;

fn trainer(directory: &Path, arguments: &str) {
    let status = Command::new(env!("CARGO_BIN_EXE_trainer"))
        .args(arguments.split(' '))
        .current_dir(directory)
        .status()
        .expect("the trainer starts");
    assert!(status.success(), "trainer {arguments}");
}

#[test]
fn retrained_recipe_matches_bundled_one() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    trainer(
        directory,
        "train --model phong --samples 1 --effort standard --data procedural:400 --noise 0.02 \
         --min-separation 10 --max-theta-i 80 --max-theta-o 80 --out retrained.recipe",
    );
    trainer(
        directory,
        "export retrained.recipe --format postcard --strip --out stripped.recipe",
    );
    let retrained = fs::read(directory.join("stripped.recipe")).expect("the file was written");
    let bundled = bundled::find("phong-n1").expect("a bundled recipe");
    // Kernels for other instruction sets sum in another order.
    match InstructionSet::detect() {
        InstructionSet::Avx512 => assert!(retrained == bundled.bytes),
        _ => assert_eq!(retrained.len(), bundled.bytes.len()),
    }
}
