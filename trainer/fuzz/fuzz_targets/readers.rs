//! Runs `glimpse_fuzz::check` on libFuzzer's inputs.

#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| glimpse_fuzz::check(input));
