//! Meta-learning of BRDF sampling: the directions to measure at, and the method to fit the readings.
//!
//! Modules in order of dependency; each module imports only earlier ones:
//!
//! - [`linear`]: principal components of materials, for the model Linear
//! - [`meta`]: meta-learning with the schedules `paper` and `prior`, and checkpoints
//! - [`run`]: a training, from materials to a recipe

pub mod linear;
pub mod meta;
pub mod run;
