//! Tests of training: tables of the model Linear, meta-gradients, nets and recipes.

mod linear;
mod meta_gradient;
mod metadata;
mod nets;
mod options;
mod scan_budget;
mod support;
