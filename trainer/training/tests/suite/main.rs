//! Tests of training: tables of the model Linear, meta-gradients, and an independent implementation of both.

mod burn_reference;
mod linear;
mod meta_gradient;
mod metadata;
mod nets;
mod problem;
mod scan_budget;
mod support;
