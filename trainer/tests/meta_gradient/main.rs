//! The meta-gradient, held against everything that can be held against it: central differences
//! of the whole unrolled loss, an independent program that burn differentiates, and itself in
//! other precision, on other lanes and on other numbers of threads.

#[path = "../../../core/tests/support/mod.rs"]
mod support;

mod determinism;
mod differences;
mod lanes;
mod problem;
mod witness;
