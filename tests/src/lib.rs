//! What the end-to-end tests share.

#[cfg(feature = "firmware")]
pub mod budgets;
#[cfg(feature = "firmware")]
pub mod cycles;
pub mod device;
#[cfg(feature = "firmware")]
pub mod elf;
#[cfg(feature = "firmware")]
pub mod emulator;
#[cfg(feature = "firmware")]
pub mod figures;
pub mod host;
pub mod line;
#[cfg(feature = "firmware")]
pub mod microcontroller;

/// The recipe that the firmware holds.
pub const RECIPE: &[u8] = include_bytes!("../../embedded-demo/recipes/neural-n8.recipe");

/// The front page's programs, compiled as documentation is.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
pub struct FrontPage;
