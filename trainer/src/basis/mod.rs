//! The whole basis of the model Linear: what turns coefficients into a BRDF, on the host.
//!
//! A [`Basis`] is tabulated on a [`Grid`]; its file lies beside the recipe, as it is far too large for a
//! device. Where a compact one lies there instead, it is looked up at core's nodes, as a device does. How it
//! is made of materials, and reduced to a pattern, is the room [`linear`](crate::linear)'s.

mod angles;
mod coefficients;
mod grid;
mod nodes;
mod table;
mod values;

pub use angles::angles_of;
pub use coefficients::CountError;
pub use grid::Grid;
pub use table::{Basis, BasisError, MAGIC as BASIS_MAGIC, Reconstruction, Tabulated};
pub use values::{ByAngles, Coefficients, widened};

pub(crate) use table::HEAD;
pub(crate) use values::median_of;
