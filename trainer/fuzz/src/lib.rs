//! Checks of the trainer's readers on untrusted bytes. The first byte of an input selects the reader.
//!
//! The fuzz target runs [`check`] on libFuzzer's inputs, and `tests/seeds.rs` on the files of `seeds`.

pub mod checkpoint;
mod lab;
mod materials;
mod support;

/// The name of a reader, with which the names of its seeds start, and its check.
pub type Reader = (&'static str, fn(&[u8]));

/// All readers.
pub const READERS: [Reader; 7] = [
    ("basis", materials::check_basis),
    ("checkpoint", checkpoint::check),
    ("material", materials::check_file),
    ("nbrdf", materials::check_network),
    ("pab", materials::check_set),
    ("readings", lab::check_readings),
    ("picture", lab::check_picture),
];

/// Checks one input.
pub fn check(input: &[u8]) {
    if let Some((reader, bytes)) = input.split_first() {
        READERS[usize::from(*reader) % READERS.len()].1(bytes);
    }
}
