//! Runs the fuzz target on its seeds, as an ordinary test.

use std::fs;
use std::path::Path;

use glimpse_core_fuzz::seeds::check_all;
use glimpse_fuzz::checkpoint::RUN;
use glimpse_training::checkpoint::TrainingState;

#[test]
fn all_seeds_pass() {
    let seeds = Path::new(env!("CARGO_MANIFEST_DIR")).join("seeds");
    check_all(&seeds, &[("readers", glimpse_fuzz::check)]);
}

/// Inputs like this seed reach all checks of the reader only if it has the current format.
#[test]
fn valid_checkpoint_is_accepted() {
    let seed = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/seeds/readers/checkpoint-valid"
    );
    let seed = fs::read(seed).expect("the seed exists");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("checkpoint.bin");
    fs::write(&path, &seed[2..]).expect("room in the temporary folder");
    let checkpoint = TrainingState::read(&path, &RUN).expect("a valid checkpoint");
    assert!(checkpoint.is_some());
}
