//! The arithmetic that models are written in: scalars, elementary functions, packed numbers.
//!
//! Public because the trainer computes with the very code that is flashed; it is **not part of this
//! crate's promise** and may change in any version. Firmware needs none of it.

mod block;
mod floats;
pub mod math;
mod scalar;

pub use block::Block;
pub use floats::Floats;
pub use scalar::{Scalar, Trigonometry, Value};
