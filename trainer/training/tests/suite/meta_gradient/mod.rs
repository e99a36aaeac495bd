//! Tests of the meta-gradient: against forward mode, on lanes, on different numbers of threads, with respect to a pattern's
//! logits, and over a batch.

mod extremes;
mod forward;
mod lanes;
mod pattern;
mod prior;
mod ridge;
