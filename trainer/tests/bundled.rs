//! A bundled recipe is what the instructions in `recipes/README.md` make. `tests/run bundled` runs this.

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
        .expect("it starts");
    assert!(status.success(), "trainer {arguments}");
}

#[test]
fn phong_of_one_sample_is_trained_again_bit_for_bit() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    trainer(
        directory,
        "train --model phong --samples 1 --effort quick --data procedural:400 --noise 0.02 \
         --min-separation 10 --max-theta-i 80 --max-theta-o 80 --out made.recipe",
    );
    trainer(
        directory,
        "export made.recipe --format postcard --strip --out stripped.recipe",
    );
    let made = fs::read(directory.join("stripped.recipe")).expect("it was written");
    let bundled = bundled::find("phong-n1").expect("it is bundled");
    // Kernels for other instruction sets add in another order.
    match InstructionSet::of_this_machine() {
        InstructionSet::Avx512 => assert!(made == bundled.bytes),
        _ => assert_eq!(made.len(), bundled.bytes.len()),
    }
}
