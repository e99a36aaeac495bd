//! Recipes that complete readings: the net from readings to coefficients, their correction, the net from coefficients to
//! initial values, Gauss-Newton steps, adjoints, scans with missing readings, and errors.

#[cfg(feature = "libm")] // f64 implements `Scalar` only with the feature libm
mod adjoint;
pub(crate) mod contents;
mod correction;
mod forward;
#[cfg(feature = "libm")] // f64 implements `Scalar` only with the feature libm
mod gauss_newton;
mod missing;
pub(crate) mod partial;
pub(crate) mod reference;
mod round_trip;
mod scans;
mod sections;
