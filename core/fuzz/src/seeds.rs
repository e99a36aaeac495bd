//! Checks of fuzz targets' seeds, for ordinary tests.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// A fuzz target: its name and its check. The folder of its seeds has the same name.
pub type Target = (&'static str, fn(&[u8]));

/// Runs each target's check on each of its seeds in `folder`, a crate's `seeds`.
///
/// # Panics
/// If a check fails, or if the folders differ from the targets.
pub fn check_all(folder: &Path, targets: &[Target]) {
    let paths_in = |folder: &Path| {
        let entries = fs::read_dir(folder).expect("the folder is readable");
        let paths = entries.map(|entry| entry.expect("the entry is readable").path());
        paths.collect::<BTreeSet<_>>()
    };
    let expected = targets.iter().map(|(name, _)| folder.join(name));
    assert_eq!(paths_in(folder), expected.collect(), "folders of seeds");
    for (name, check) in targets {
        let seeds = paths_in(&folder.join(name));
        assert!(!seeds.is_empty(), "{name} has no seeds");
        for seed in seeds {
            println!("{}", seed.display()); // identifies the seed if its check fails
            check(&fs::read(&seed).expect("the seed is readable"));
        }
    }
}
