//! Meta-learning of BRDF sampling: where to measure, and how to fit.
//!
//! Modules from the bottom up, each importing only those before it:
//!
//! - [`linear`]: principal components of materials, for the model Linear
//! - [`meta`]: meta-learning with the schedules `paper`, `joint` and `prior`, and checkpoints
//! - [`recipe`]: recipe files, and the conversion of a training result to a recipe

pub mod linear;
pub mod meta;
pub mod recipe;
