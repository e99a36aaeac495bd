//! A scanner that moves its own arms: step and direction pins, home switches, a sensor, and a flash
//! that keeps what was read.
//!
//! Generic over the traits of `embedded-hal` and `embedded-storage`, free of any chip; the binaries
//! say what it runs on. The README beside this folder is the way in.

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

use glimpse_core::fit::{AnyModel, linear_words};
use glimpse_core::scan;

/// The largest number of samples that a recipe may have here.
pub const CAPACITY: usize = 60;
/// The largest number of components that a recipe of Linear may have, with that many samples.
pub const COMPONENTS: usize = 24;

/// How readings are fitted: as the recipe says, since it may be replaced by one for another model. A
/// firmware that names one model instead, as `Neural`, is smaller.
pub type Model = AnyModel<{ linear_words(CAPACITY, COMPONENTS) }>;
/// The memory of scan and fit.
pub type Memory = scan::Memory<Model, CAPACITY>;
