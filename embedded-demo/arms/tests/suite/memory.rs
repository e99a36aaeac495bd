//! Memory of scan and fit, for recipes that a host may send.

use std::fs;
use std::path::Path;

use glimpse_arms::{MEMORY_WORDS, Model};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Scan;

/// Collects all recipes in `trainer/recipes`.
fn bundled(directory: &Path, recipes: &mut Vec<Vec<u8>>) {
    for entry in fs::read_dir(directory).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            bundled(&path, recipes);
        } else if path
            .extension()
            .is_some_and(|extension| extension == "recipe")
        {
            recipes.push(fs::read(path).unwrap());
        }
    }
}

#[test]
fn memory_fits_every_bundled_recipe() {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../trainer/recipes");
    let mut recipes = Vec::new();
    bundled(&directory, &mut recipes);
    assert!(recipes.len() > 20);
    let words = recipes.iter().map(|bytes| {
        let recipe = Recipe::parse(bytes).unwrap();
        Scan::<Model>::accept(&recipe, MEMORY_WORDS).unwrap()
    });
    let largest = words.max().unwrap();
    println!("the largest recipe needs {largest} of {MEMORY_WORDS} words");
}
