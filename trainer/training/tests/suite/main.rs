//! The results of training: tables of the model Linear, meta-gradients, and the same by an independent program.

mod burn_witness;
mod linear;
mod meta_gradient;
mod problem;
mod support;
