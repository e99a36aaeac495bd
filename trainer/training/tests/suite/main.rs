//! Tests of training: tables of the model Linear, meta-gradients, and an independent implementation of both.

mod burn_reference;
mod gauss_newton;
mod linear;
mod meta_gradient;
mod metadata;
mod problem;
mod scan_budget;
mod support;
