//! Checks of core's decoders on untrusted bytes, a module for each decoder.
//!
//! `fuzz_targets` runs them on libFuzzer's inputs, `tests/seeds.rs` on the files of `seeds`.

pub mod basis;
pub mod link;
pub mod recipe;
pub mod seeds;
