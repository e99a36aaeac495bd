//! The basis of the model Linear.
//!
//! A fit of Linear ends in coefficients of principal components. A [`Basis`] makes a BRDF of them on the device.

mod basis;
mod error;
internal! { mod format }
mod mapping;
mod nodes;

pub use basis::Basis;
pub use error::BasisError;

internal! { mapping::{EPSILON, map, unmap} }
internal! { nodes::{Corner, Nodes} }
