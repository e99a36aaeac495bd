//! Runs all fuzz targets on their seeds, as an ordinary test.

use std::path::Path;

use glimpse_core_fuzz::seeds::{Target, check_all};

#[test]
fn all_seeds_pass() {
    let targets: &[Target] = &[
        ("basis", glimpse_trainer_fuzz::basis::check),
        ("checkpoint", glimpse_trainer_fuzz::checkpoint::check),
        ("environment", glimpse_trainer_fuzz::environment::check),
        ("format", glimpse_trainer_fuzz::format::check),
        ("material", glimpse_trainer_fuzz::material::check),
        ("merl", glimpse_trainer_fuzz::merl::check),
        ("nbrdf", glimpse_trainer_fuzz::nbrdf::check),
        ("pab", glimpse_trainer_fuzz::pab::check),
        ("readings", glimpse_trainer_fuzz::readings::check),
        ("rgl", glimpse_trainer_fuzz::rgl::check),
    ];
    check_all(
        &Path::new(env!("CARGO_MANIFEST_DIR")).join("seeds"),
        targets,
    );
}
