//! Firmware of a scanner that moves its own arms: stepper drivers, home switches, a sensor, and a flash for readings
//! and recipes.
//!
//! The library is generic over the traits of `embedded-hal` and `embedded-storage` and independent of the chip. The
//! binaries in `src/bin` add a chip or a simulation. Start with the README in the folder above.

#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]
#![deny(
    clippy::panic,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::indexing_slicing
)]

pub mod axis;
pub mod flash_ram;
pub mod goniometer;
pub mod retained;
pub mod route;
pub mod scanner;
pub mod sensor;
pub mod simulated;
pub mod station;
pub mod store;

use glimpse_core::fit::AnyModel;

/// The model that the recipe names: a host may send a recipe for another model. The firmware is smaller with one model,
/// such as `Neural`.
pub type Model = AnyModel;

/// Words of the memory of scan and fit: 12 KiB.
///
/// The memory cannot grow when a host sends a larger recipe, so it is larger than the bundled recipe needs: 1,423 words
/// by [`memory_words`](glimpse_core::recipe::memory_words). It is enough for every recipe in `trainer/recipes`; the
/// largest needs 1,639 words. It is also enough for the trainer's recipes of Neural with Gauss-Newton steps, which need
/// 2,900 words with 64 samples. The firmware rejects a recipe that needs more and keeps the present one.
pub const MEMORY_WORDS: usize = 3072;
