//! Runs `glimpse_core_fuzz::link` on libFuzzer's inputs.

#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| glimpse_core_fuzz::link::check(input));
