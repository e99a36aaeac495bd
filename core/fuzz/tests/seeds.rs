//! Checks of all seeds of all fuzz targets.

use std::path::Path;

use glimpse_core_fuzz::seeds::{Target, check_all};

#[test]
fn every_seed_passes() {
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
