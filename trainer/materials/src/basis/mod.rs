//! The whole basis of the model Linear: what turns coefficients into a BRDF, on the host.
//!
//! A [`Basis`] is tabulated on a [`Grid`]; its file lies beside the recipe, as it is far too large for a
//! device. Where a compact one lies there instead, it is looked up at core's nodes, as a device does.
//! `glimpse_training::linear` makes it of materials, and reduces it to a pattern.

mod angles;
mod coefficients;
mod grid;
mod nodes;
mod table;
mod values;

pub use angles::angles_of;
pub use coefficients::CoefficientCountError;
pub use grid::Grid;
pub use table::{
    Basis, BasisError, BasisValues, MAGIC as BASIS_MAGIC, NODE_HEADER, Reconstruction,
};
pub use values::{AngleDual, Coefficients, angles_to_f64, median_brdf};
