//! Tests of training: tables of the model Linear, meta-gradients and recipes.

mod linear;
mod meta_gradient;
mod metadata;
mod options;
mod scan_budget;
mod support;
