//! A scanner that moves its own arms: step and direction pins, home switches, a sensor, and a flash
//! that keeps what was read.
//!
//! Generic over the traits of `embedded-hal` and `embedded-storage`, free of any chip; the binaries
//! say what it runs on. The README beside this folder is the way in.

#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

pub mod axis;
pub mod flash_ram;
pub mod goniometer;
pub mod retained;
pub mod scanner;
pub mod sensor;
pub mod simulated;
pub mod station;
pub mod store;

/// The largest number of samples that a recipe may have here. (A sector of the simulated flash keeps
/// twice as many readings.)
pub const CAPACITY: usize = 60;
