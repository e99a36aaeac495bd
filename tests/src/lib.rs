//! Shared parts of the end-to-end tests.

pub mod budgets;
pub mod cycles;
pub mod device;
pub mod emulator;
pub mod figures;
pub mod host;
pub mod microcontroller;
pub mod noisy_line;

/// The firmware's built-in recipe.
pub const RECIPE: &[u8] = include_bytes!("../../trainer/recipes/paper/neural-n8.recipe");

/// The programs of the front page, compiled as documentation tests.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
pub struct FrontPage;
