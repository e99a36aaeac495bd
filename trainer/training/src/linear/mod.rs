//! The model Linear on the host: principal components of materials after a logarithmic mapping, and patterns for these
//! components (Nielsen et al. 2015; paper, "Models: Linear").
//!
//! Materials are tabulated on a [`Grid`] as l = ln(brdf w + e), with w = cos(theta_i) cos(theta_o) and e = 0.001. The
//! paper's mapping is ln((brdf w + e) / (median w + e)). At each node, it differs from l by the same number for all
//! materials, so both have the same principal components. A [`BasisTable`] holds the components. Its file is stored next to the recipe, because it is too large for a device. The ridge solve
//! and its adjoint are in core.
//!
//! [`BasisTable`]: glimpse_materials::basis::BasisTable
//! [`Grid`]: glimpse_materials::basis::Grid

mod columns;
mod condition;
mod gaussian_prior;

pub use columns::{Columns, MAX_TABULATED, principal_components};
pub use condition::min_condition_pattern;
pub use gaussian_prior::GaussianPrior;
