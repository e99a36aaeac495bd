//! Arithmetic of a machine with arms and a sensor: plain arithmetic, free of I/O.
//!
//! - [`Limits`]: where its arms get to;
//! - [`Machine`]: how fast they are, and which pending pair of directions they reach soonest;
//! - [`Calibration`]: counts to BRDF by dark and white readings;
//! - [`Quantity`]: the BRDF, and what it is taken for by mistake;
//! - [`Repeated`]: the mean of repeated readings, and how much they vary;
//! - [`tile::examine`]: whether all of that ends in BRDFs, by a tile of known reflectance.
//!
//! # One channel, and channels in turn
//!
//! A scan has three channels. A monochrome sensor gives the same number in all three
//! ([`Calibration::monochrome`], [`Calibrated::monochrome`]); the fitted BRDF has it in each, and
//! costs no more time. A monochrome sensor behind three filters, or three lamps that are lit in
//! turn, is calibrated like one with three channels: dark, white and sample are read once with each,
//! and the three numbers go together into one array.

mod calibration;
mod decimal;
mod limits;
mod nearest;
mod quantity;
mod repeated;
pub mod tile;

pub use calibration::{Calibrated, Calibration, CalibrationError, Footprint, ReferenceCalibration};
pub use limits::{Limits, LimitsError, Unreachable};
pub use nearest::{Machine, Move, Speeds};
pub use quantity::{CosineError, Quantity};
pub use repeated::{Repeated, RepeatedError};
