//! The trainer's inner loops: sums over many samples of a BRDF on SIMD lanes, the exact adjoint of a
//! fit by descent, and the device's own fit.
//!
//! A crate of its own because it takes long to compile, for each model on each instruction set, and
//! needs nothing but core: so it is compiled beside the trainer's other dependencies, and not again
//! when the trainer changes.
//!
//! Files from the bottom up; each takes from those before it only:
//!
//! - [`dual`]: numbers with derivatives
//! - [`lanes`]: registers, and what runs on them
//! - [`samples`]: samples in memory, as registers load them
//! - [`sums`]: gradient, Hessian times vector and loss, over samples on one thread
//! - [`brdf`]: a model at many places
//! - [`completion`]: readings of many materials, completed, and the adjoint
//! - [`components`]: the loss of a material that is made of principal components
//! - [`inner_loop`]: descent, unrolled, and its adjoint
//! - [`lane_model`]: what all of these are for a model
//! - `parallel`: sums on all threads
//! - `compiled`: the models, each with all of it
//! - [`scan`]: a scan as the device does it, by any recipe

pub mod brdf;
mod compiled;
pub mod completion;
pub mod components;
pub mod dual;
pub mod inner_loop;
pub mod lane_model;
pub mod lanes;
mod parallel;
pub mod samples;
pub mod scan;
pub mod sums;

pub use dual::Dual;
pub use lane_model::LaneModel;
