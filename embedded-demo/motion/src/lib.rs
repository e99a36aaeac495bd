#![doc = include_str!("../README.md")]
#![no_std]
#![forbid(unsafe_code)]
#![deny(clippy::panic, clippy::indexing_slicing)]
#![deny(clippy::unwrap_used, clippy::expect_used)]

#[cfg(feature = "simulation")]
extern crate std;

mod error;

pub mod axis;
pub mod goniometer;
pub mod route;
#[cfg(feature = "simulation")]
pub mod simulation;
pub mod store;

pub use error::MotionError;
