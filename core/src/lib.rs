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

// From the bottom up: a module imports from modules earlier in this list only.
//
// checksum, error_code, geometry, numeric, model, fit, gonio, recipe, scan, link, driver
#[deny(clippy::arithmetic_side_effects)]
pub mod checksum;
#[deny(clippy::arithmetic_side_effects)]
pub mod driver;
pub mod error_code;
pub mod fit;
pub mod geometry;
#[deny(clippy::arithmetic_side_effects)]
pub mod gonio;
#[deny(clippy::arithmetic_side_effects)]
pub mod link;
pub mod model;
pub mod numeric;
#[deny(clippy::arithmetic_side_effects)]
pub mod recipe;
#[deny(clippy::arithmetic_side_effects)]
pub mod scan;
