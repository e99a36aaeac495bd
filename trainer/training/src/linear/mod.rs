//! The Linear model on the host: principal components of mapped materials, and the training of
//! where to sample them (Nielsen et al. 2015; paper, "Models: Linear").
//!
//! Materials are tabulated on a [`Grid`] as l = ln(brdf w + e), w = cos(theta_i) cos(theta_o); what
//! the paper maps, ln((brdf w + e) / (median w + e)), differs from l by the same number in every
//! column, so that its principal components are those of l. A [`Basis`] holds them, and is what
//! turns the device's coefficients into a BRDF again; its file lies beside the recipe, as it is
//! far too large for a device. The ridge solve and its adjoint are core's.
//!
//! [`Basis`]: glimpse_materials::basis::Basis
//! [`Grid`]: glimpse_materials::basis::Grid

mod columns;
mod compact;
mod components;
mod condition;
mod least_squares;
mod prior;
mod recipe_basis;
mod reduced;
mod single;

pub use columns::{Columns, MOST_TABULATED};
pub use compact::{COMPACT_COMPONENTS, COMPACT_NODES, compact};
pub use components::principal_components;
pub use condition::least_condition;
pub use prior::Prior;
pub use recipe_basis::ReducedBasis;
pub use reduced::Reduced;
pub use single::{CHANNELS, SINGLE_NODES, single_material};
