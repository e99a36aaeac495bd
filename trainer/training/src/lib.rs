//! Meta-learning of BRDF sampling: where to measure, and how to fit.
//!
//! Modules from the bottom up, each importing only those before it:
//!
//! - [`linear`]: principal components of materials, for the model Linear
//! - [`meta`]: meta-learning by the schedules paper, joint and prior, with checkpoints
//! - [`recipe`]: recipe files, and the recipe of a training run

pub mod linear;
pub mod meta;
pub mod recipe;
