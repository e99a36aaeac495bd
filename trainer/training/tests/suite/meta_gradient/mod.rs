//! The meta-gradient on lanes, on any number of threads, by a pattern's logits and over a batch. (`burn_witness`
//! compares it with an independent program, `differences` and `linear_differences` with differences of the loss.)

mod completion;
mod determinism;
mod differences;
mod extremes;
mod lanes;
mod linear;
mod linear_differences;
mod pattern;
