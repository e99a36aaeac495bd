#![doc = include_str!("../README.md")]
#![no_std]
#![forbid(unsafe_code)]
#![deny(clippy::panic, clippy::indexing_slicing)]
#![deny(clippy::unwrap_used, clippy::expect_used)]

mod error;

pub mod axis;
pub mod goniometer;
pub mod route;
pub mod store;

pub use error::MotionError;
