//! Runs the fuzz target on its seeds, as an ordinary test.

use std::path::Path;

use glimpse_core_fuzz::seeds::check_all;

#[test]
fn all_seeds_pass() {
    let seeds = Path::new(env!("CARGO_MANIFEST_DIR")).join("seeds");
    check_all(&seeds, &[("readers", glimpse_fuzz::check)]);
}
