//! Recipes that complete readings: the net from readings to coefficients, the net from coefficients to initial values
//! of a descent, their adjoints, scans with missing readings, and errors.

#[cfg(feature = "libm")] // f64 implements `Scalar` only with the feature libm
mod adjoint;
pub(crate) mod contents;
mod errors;
mod forward;
mod missing;
mod prediction;
mod reference;
mod round_trip;
mod scans;
