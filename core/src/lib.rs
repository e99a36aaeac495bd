#![doc = include_str!("../README.md")]
#![no_std]
#![forbid(unsafe_code)]
#![deny(
    clippy::panic,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::string_slice,
    clippy::unreachable,
    clippy::arithmetic_side_effects
)]
// Without the feature `training`, internals for training are private and partly unused.
#![cfg_attr(
    not(feature = "training"),
    allow(dead_code, unreachable_pub, unused_imports)
)]

/// Exports a module or items: publicly with the feature `training`, otherwise within the crate.
macro_rules! internal {
    (mod $name:ident) => {
        #[cfg(feature = "training")]
        pub mod $name;
        #[cfg(not(feature = "training"))]
        pub(crate) mod $name;
    };
    ($($path:tt)*) => {
        #[cfg(feature = "training")]
        pub use $($path)*;
        #[cfg(not(feature = "training"))]
        pub(crate) use $($path)*;
    };
}

// From the bottom up: a module imports only from modules earlier in this list.
//
// checksum, error, file, geometry, numeric, model, fit, gonio, recipe, scan, store, link, driver
pub mod checksum;
pub mod driver;
pub mod error;
internal! { mod file }
#[allow(clippy::arithmetic_side_effects)]
pub mod fit;
#[allow(clippy::arithmetic_side_effects)]
pub mod geometry;
pub mod gonio;
pub mod link;
#[allow(clippy::arithmetic_side_effects)]
pub mod model;
internal! { mod numeric }
pub mod recipe;
pub mod scan;
internal! { mod section }
pub mod store;
