//! The basis of the model Linear, which turns coefficients into a BRDF on the host.
//!
//! A training tabulates a [`BasisTable`] on a [`Grid`]. Its file, in the directory of the recipe, has values at core's nodes, which
//! are interpolated as on a device: at more of them than fit into flash, or at those that do. `glimpse_training::linear`
//! computes the basis from materials and reduces it to a pattern.

mod angles;
mod grid;
mod kernels;
mod table;

pub use angles::{angles_of, half_differences};
pub(crate) use angles::{finite_f32, split_duals};
pub use grid::{Grid, WeightedNode};
pub use kernels::{KernelSum, Kernels, Place, correlation};
pub use table::{BasisError, BasisTable, BasisValues, NODE_HEADER, Reconstruction};
