#![doc = include_str!("../README.md")]
#![no_std]
#![forbid(unsafe_code)]
#![deny(
    clippy::panic,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::string_slice,
    clippy::unreachable
)]

pub mod angles;
#[deny(clippy::arithmetic_side_effects)]
pub mod fit;
pub mod linear;
#[deny(clippy::arithmetic_side_effects)]
pub mod link;
pub mod loss;
pub mod math;
pub mod model;
#[deny(clippy::arithmetic_side_effects)]
pub mod recipe;
pub mod scalar;
#[deny(clippy::arithmetic_side_effects)]
pub mod scan;
