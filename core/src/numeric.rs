//! Arithmetic of the models: scalars, elementary functions, packed numbers.
//!
//! It is public because the trainer uses the same code as the firmware. It is **not part of this crate's stable API**,
//! and may change in any version. Firmware does not need it.

#![allow(clippy::arithmetic_side_effects)]

mod floats;
pub mod math;
mod parts;
mod rows;
mod scalar;

pub use floats::Floats;
pub use parts::split;
pub use rows::{ComponentRows, Matrix, PackedRows, Rows};
pub use scalar::{Real, Scalar, Stored, Trigonometry, Value};
