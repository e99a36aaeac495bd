//! Runs all fuzz targets on their seeds, as an ordinary test.

use std::path::Path;

use glimpse_core_fuzz::seeds::{Target, check_all};

#[test]
fn all_seeds_pass() {
    let targets: &[Target] = &[
        ("basis", glimpse_core_fuzz::basis::check),
        ("link", glimpse_core_fuzz::link::check),
        ("recipe", glimpse_core_fuzz::recipe::check),
    ];
    check_all(
        &Path::new(env!("CARGO_MANIFEST_DIR")).join("seeds"),
        targets,
    );
}
