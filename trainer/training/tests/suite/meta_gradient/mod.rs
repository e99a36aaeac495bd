//! The meta-gradient against central differences, and against itself in other precision, on other lanes and on other
//! numbers of threads. (`burn_witness` holds it against an independent program.)

mod completion;
mod determinism;
mod extremes;
mod lanes;
mod linear;
mod pattern;
