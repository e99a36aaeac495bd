//! What the end-to-end tests share.

pub mod budgets;
pub mod cycles;
pub mod device;
pub mod elf;
pub mod emulator;
pub mod figures;
pub mod host;
pub mod line;
pub mod microcontroller;

/// The recipe that the firmware holds.
pub const RECIPE: &[u8] = include_bytes!("../../trainer/recipes/neural-n8.recipe");

/// The front page's programs, compiled as documentation is.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
pub struct FrontPage;
