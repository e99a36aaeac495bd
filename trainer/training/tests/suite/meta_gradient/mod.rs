//! Tests of the meta-gradient: on lanes, on different numbers of threads, with respect to a pattern's logits, and over
//! a batch.
//!
//! `finite_differences` and `linear_finite_differences` compare it with differences of the loss, and `burn_reference`
//! with an independent implementation.

mod completion;
mod determinism;
mod extremes;
mod finite_differences;
mod lanes;
mod linear;
mod linear_finite_differences;
mod pattern;
