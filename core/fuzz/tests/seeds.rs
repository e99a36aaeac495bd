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
    check_all("basis", glimpse_core_fuzz::basis::check);
}

#[test]
fn link_seeds_pass() {
    check_all("link", glimpse_core_fuzz::link::check);
}

#[test]
fn recipe_seeds_pass() {
    check_all("recipe", glimpse_core_fuzz::recipe::check);
}
