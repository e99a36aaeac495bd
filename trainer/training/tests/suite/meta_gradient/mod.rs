//! The meta-gradient on lanes, on any number of threads, by a pattern's logits and over a batch. (`burn_reference`
//! compares it with an independent program, `finite_differences` and `linear_finite_differences` with finite_differences of the loss.)

mod completion;
mod determinism;
mod extremes;
mod finite_differences;
mod lanes;
mod linear;
mod linear_finite_differences;
mod pattern;
