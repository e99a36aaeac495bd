//! Runs `glimpse_trainer_fuzz::nbrdf` on libFuzzer's inputs.

#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| glimpse_trainer_fuzz::nbrdf::check(input));
