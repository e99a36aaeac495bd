//! What the end-to-end tests share.

pub mod device;
#[cfg(feature = "firmware")]
pub mod elf;
#[cfg(feature = "firmware")]
pub mod emulator;
pub mod line;

/// The recipe that the firmware holds.
pub const RECIPE: &[u8] = include_bytes!("../../embedded-demo/recipes/neural-n8.recipe");
