//! Tests of motion and storage on a host.

mod motion;
mod route;
mod store;
