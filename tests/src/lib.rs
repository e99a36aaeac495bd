//! Shared parts of the end-to-end tests.

pub mod budgets;
pub mod cycles;
pub mod device;
pub mod emulator;
pub mod figures;
pub mod host;
pub mod microcontroller;
pub mod noisy_line;

use glimpse_fitting::bundled;

/// The firmware's built-in recipe.
pub const RECIPE: &[u8] = include_bytes!("../../trainer/recipes/paper/neural-n8.recipe");

/// Returns names and recipes of every model and kind: the bundled ones with a pattern, and those of the benchmarks.
#[must_use]
pub fn recipes() -> Vec<(&'static str, &'static [u8])> {
    let bundled = bundled::ALL.iter().map(|each| (each.name, each.bytes));
    let with_pattern = bundled.filter(|(name, _)| !name.ends_with("-any"));
    let fits = figures::FIT_BINARIES.map(|fit| (fit.name, fit.recipe));
    let mut recipes: Vec<_> = with_pattern.chain(fits).collect();
    recipes.sort_by_key(|(_, bytes)| *bytes);
    recipes.dedup_by_key(|(_, bytes)| *bytes);
    recipes
}

/// The programs of the front page, compiled as documentation tests.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
pub struct FrontPage;
