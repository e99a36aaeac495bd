//! Every seed of every fuzz target, as an ordinary test.

use std::fs;
use std::path::Path;

/// Runs a target's check on each of its seeds.
fn check_all(target: &str, check: fn(&[u8])) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("seeds")
        .join(target);
    let mut count = 0;
    for entry in fs::read_dir(&folder).expect("the target has seeds") {
        let path = entry.expect("an entry").path();
        println!("{}", path.display()); // names the seed where a check fails
        check(&fs::read(&path).expect("a seed is a file"));
        count += 1;
    }
    assert!(count > 0, "no seeds in {}", folder.display());
}

#[test]
fn basis_seeds_pass() {
    check_all("basis", glimpse_trainer_fuzz::basis::check);
}

#[test]
fn checkpoint_seeds_pass() {
    check_all("checkpoint", glimpse_trainer_fuzz::checkpoint::check);
}

#[test]
fn device_seeds_pass() {
    check_all("device", glimpse_trainer_fuzz::device::check);
}

#[test]
fn environment_seeds_pass() {
    check_all("environment", glimpse_trainer_fuzz::environment::check);
}

#[test]
fn format_seeds_pass() {
    check_all("format", glimpse_trainer_fuzz::format::check);
}

#[test]
fn material_seeds_pass() {
    check_all("material", glimpse_trainer_fuzz::material::check);
}

#[test]
fn merl_seeds_pass() {
    check_all("merl", glimpse_trainer_fuzz::merl::check);
}

#[test]
fn nbrdf_seeds_pass() {
    check_all("nbrdf", glimpse_trainer_fuzz::nbrdf::check);
}

#[test]
fn pab_seeds_pass() {
    check_all("pab", glimpse_trainer_fuzz::pab::check);
}

#[test]
fn readings_seeds_pass() {
    check_all("readings", glimpse_trainer_fuzz::readings::check);
}

#[test]
fn rgl_seeds_pass() {
    check_all("rgl", glimpse_trainer_fuzz::rgl::check);
}
