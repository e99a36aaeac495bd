//! The basis of the model Linear, which turns coefficients into a BRDF on the host.
//!
//! A whole [`Basis`] is tabulated on a [`Grid`]. It is far too large for a device, so that it has its own file in the
//! directory of the recipe. This file may also be a compact basis, which is interpolated between core's nodes, as on a
//! device. `glimpse_training::linear` computes the basis from materials and reduces it to a pattern.

mod angles;
mod grid;
mod nodes;
mod table;

pub use angles::{AngleDual, angles_of};
pub(crate) use angles::{finite_f32, split_duals};
pub use grid::{Corner, Grid};
pub use table::{
    Basis, BasisError, BasisValues, CoefficientCountError, Coefficients, NODE_HEADER,
    Reconstruction,
};
