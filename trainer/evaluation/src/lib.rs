//! Methods of fitting a BRDF, and their errors on materials.
//!
//! The list has the modules in order, lowest first; `tests/check_layers.py` enforces it.
//!
//! - [`render`]: images of spheres in a built-in studio, and photographs
//! - [`metrics`]: errors of a fit against its material
//! - `least_squares` (internal): fits of parameters within bounds
//! - [`shading`]: shading models of renderers, fitted to a BRDF
//! - [`evaluation`]: fitting methods and their errors on materials
//! - [`conversion`]: materials in the formats of other programs

pub mod conversion;
pub mod evaluation;
mod least_squares;
pub mod metrics;
pub mod render;
pub mod shading;
