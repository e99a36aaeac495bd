//! Checks of core's decoders on untrusted bytes, with one module for each decoder.
//!
//! `fuzz_targets` runs them on libFuzzer's inputs, `tests/seeds.rs` on the files in `seeds`, and a test of core on forged
//! recipes.

pub mod basis;
pub mod link;
pub mod recipe;
pub mod seeds;
