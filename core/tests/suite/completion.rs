//! A recipe that completes readings: the map from readings to coefficients and on to a descent's
//! start, its adjoint, scans by it with some of the readings, and refusals.

#[cfg(feature = "libm")] // f64 is a scalar with libm only
mod adjoint;
pub(crate) mod contents;
mod errors;
mod forward;
mod missing;
mod prediction;
mod reference;
mod round_trip;
mod scans;
