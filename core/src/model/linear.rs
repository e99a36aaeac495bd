//! The basis of the model Linear.
//!
//! A fit of Linear yields coefficients of principal components. A [`Basis`] turns them into a BRDF on the device.

mod basis;
internal! { mod format }
mod mapping;
mod nodes;

pub use basis::Basis;

internal! { mapping::{EPSILON, map, unmap} }
internal! { nodes::{Corner, Nodes} }
