//! Checks of core's decoders on untrusted bytes, with one module for each decoder.
//!
//! `fuzz_targets` runs them on libFuzzer's inputs, and `tests/seeds.rs` on the files in `seeds`.

pub mod basis;
pub mod link;
pub mod recipe;
pub mod seeds;
