//! Seeds of fuzz targets, checked by ordinary tests.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// A fuzz target: its name and its check. The name is also the folder of its seeds.
pub type Target = (&'static str, fn(&[u8]));

/// Runs each target's check on each of its seeds in `folder`, a crate's `seeds`.
///
/// # Panics
/// If a check fails, or if the folders differ from the targets.
pub fn check_all(folder: &Path, targets: &[Target]) {
    let entries = |folder: &Path| {
        let entries = fs::read_dir(folder).expect("a folder of seeds");
        let paths = entries.map(|entry| entry.expect("an entry").path());
        paths.collect::<BTreeSet<_>>()
    };
    let expected = targets.iter().map(|(name, _)| folder.join(name));
    assert_eq!(entries(folder), expected.collect(), "folders of seeds");
    for (name, check) in targets {
        let seeds = entries(&folder.join(name));
        assert!(!seeds.is_empty(), "{name} has no seeds");
        for seed in seeds {
            println!("{}", seed.display()); // identifies the seed if its check fails
            check(&fs::read(&seed).expect("a seed is a file"));
        }
    }
}
