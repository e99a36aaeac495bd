//! The host side of Glimpse: evaluation, rendering, reports, and fits of readings from a lab.
//!
//! The list has the modules in order, lowest first. A module imports only modules above it in this list, and
//! no two files import each other. `tests/check_layers.py` reads the list and enforces both.
//!
//! - [`bundled`]: bundled recipes
//! - [`measurement`]: readings from a lab, matched to a pattern, checked for outliers and fitted
//! - [`export`]: recipes in other formats
//! - [`render`]: images of spheres in a built-in studio
//! - [`metrics`]: errors of a fit against its material
//! - `least_squares` (internal): fits of parameters within bounds
//! - [`evaluation`]: fitting methods and their errors on materials
//! - [`shading`]: shading models of renderers, fitted to a BRDF
//! - [`conversion`]: materials in the formats of other programs
//! - [`scanner`]: the virtual scanner
//!
//! The program `trainer` and its pages are the crate `glimpse_program`. All modules build on separate crates:
//! [`glimpse_training`] (meta-learning, recipes), [`glimpse_materials`]
//! (sources of BRDFs, the loss), [`glimpse_optimizer`] (storage and update of the meta-parameters, on burn) and
//! [`glimpse_kernels`] (SIMD sums over samples, and the adjoint of the fit).

pub mod bundled;
pub mod conversion;
pub mod evaluation;
pub mod export;
mod least_squares;
pub mod measurement;
pub mod metrics;
pub mod render;
pub mod scanner;
pub mod shading;
