//! Arithmetic of a scanner with two arms and a sensor, without I/O:
//!
//! - [`Limits`]: the reach of its arms;
//! - [`Machine`]: its axes with their speeds, and the pending sample that the arms reach first;
//! - [`Reading`]: a reading of the sensor;
//! - [`Calibration`]: the conversion of counts to the BRDF, with dark and white readings;
//! - [`Quantity`]: the BRDF, and quantities that are mistaken for it;
//! - [`Repeated`]: mean and variance of repeated readings;
//! - [`tile::examine`]: a self-test of the whole conversion, with a tile of known reflectance.
//!
//! # Monochrome sensors
//!
//! A scan has three channels. A reading of a monochrome sensor repeats its number in all three
//! ([`Calibration::monochrome`], [`Reading::monochrome`]). The fitted BRDF is then gray, and the fit takes no more time.
//!
//! A monochrome sensor with three filters, or with three lamps that are lit in turn, is calibrated like a sensor with
//! three channels: read dark, white and sample once with each filter or lamp, and combine each three numbers into an
//! array.

mod calibration;
mod limits;
mod nearest;
mod quantity;
mod reading;
mod repeated;
pub mod tile;

pub use calibration::{Calibration, Footprint, ReferenceCalibration};
pub use limits::Limits;
pub use nearest::{Machine, Move};
pub use quantity::Quantity;
pub use reading::{MIN_READING, Reading};
pub use repeated::Repeated;
