//! Meta-learning of BRDF sampling: the directions to measure at, and the method to fit the readings. It ends with a recipe.
//!
//! Modules in order of dependency; each module imports only earlier ones:
//!
//! - [`linear`]: principal components of materials, for the model Linear
//! - [`initialization`]: initial parameters
//! - [`pattern`]: patterns above the horizon and within limits
//! - [`tasks`]: simulated scans of materials
//! - [`correction`]: coefficients that agree with their readings
//! - [`scan_budget`]: patterns within a time of scanning
//! - [`checkpoint`]: states of interrupted runs
//! - [`loss_predictor`]: the loss of a fit, predicted from its readings
//! - `result`: the result of a run
//! - [`outer`]: the loop over steps and phases
//! - `job`: the input of a run
//! - [`streams`]: random numbers of steps
//! - [`paper`]: the schedule of the paper
//! - [`prior`]: the schedule that completes readings by a learned prior
//! - [`run`]: a training, from materials to a recipe

pub mod checkpoint;
pub mod correction;
pub mod initialization;
mod job;
pub mod linear;
pub mod loss_predictor;
pub mod outer;
pub mod paper;
pub mod pattern;
pub mod prior;
mod result;
pub mod run;
pub mod scan_budget;
pub mod streams;
pub mod tasks;
