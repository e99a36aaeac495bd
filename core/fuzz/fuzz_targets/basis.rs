//! Runs `glimpse_core_fuzz::basis` on libFuzzer's inputs.

#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| glimpse_core_fuzz::basis::check(input));
