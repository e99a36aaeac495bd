//! Runs `glimpse_trainer_fuzz::check` on libFuzzer's inputs.

#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| glimpse_trainer_fuzz::check(input));
