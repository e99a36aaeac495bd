//! Meta-learning of BRDF sampling: the directions to measure at, and the method to fit the readings.
//!
//! Modules in order of dependency; each module imports only earlier ones:
//!
//! - [`choice`]: names of choices on the command line
//! - [`route`]: the order in which a machine's arms visit samples
//! - [`linear`]: principal components of materials, for the model Linear
//! - [`meta`]: meta-learning with the schedules `paper` and `prior`, and checkpoints
//! - [`recipe`]: recipe files, and their metadata
//! - [`run`]: a training, from materials to a recipe

pub mod choice;
pub mod linear;
pub mod meta;
pub mod recipe;
pub mod route;
pub mod run;
