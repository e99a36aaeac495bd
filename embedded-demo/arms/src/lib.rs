//! A scanner that moves its own arms: step and direction pins, home switches, a sensor, and a flash
//! that keeps what was read.
//!
//! Generic over the traits of `embedded-hal` and `embedded-storage`, free of any chip; the binaries
//! say what it runs on. The README beside this folder is the way in.

#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

pub mod axis;
pub mod goniometer;
pub mod sensor;
pub mod store;

