//! The Linear model on the host: principal components of mapped materials, and the training of
//! where to sample them (Nielsen et al. 2015; paper, "Models: Linear").
//!
//! Materials are tabulated on a [`Grid`] as l = ln(brdf w + e), w = cos(theta_i) cos(theta_o); what
//! the paper maps, ln((brdf w + e) / (median w + e)), differs from l by the same number in every
//! column, so that its principal components are those of l. A [`Basis`] holds them, and is what
//! turns the device's coefficients into a BRDF again; its file lies beside the recipe, as it is
//! far too large for a device. The ridge solve and its adjoint are core's.

mod basis;
mod coefficients;
mod columns;
mod compact;
mod condition;
mod grid;
mod least_squares;
mod prior;
mod recipe_basis;
mod reduced;
mod values;

pub use basis::{Basis, BasisError, MAGIC as BASIS_MAGIC, Reconstruction, Tabulated};
pub use coefficients::CountError;
pub use columns::Columns;
pub use compact::{COMPACT_COMPONENTS, COMPACT_NODES};
pub use condition::least_condition;
pub use grid::Grid;
pub use prior::Prior;
pub use recipe_basis::ReducedBasis;
pub use reduced::Reduced;
pub use values::{ByAngles, Coefficients, widened};
