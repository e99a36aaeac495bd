//! The meta-gradient on lanes, on any number of threads, by a pattern's logits and over a batch. (`burn_witness`
//! holds it against an independent program, `differences` against its loss.)

mod completion;
mod determinism;
mod differences;
mod extremes;
mod lanes;
mod linear;
mod pattern;
