//! In which order a machine's arms go to a recipe's samples, and where they stand for each.
//!
//! - [`Machine`]: how fast its axes are, and what it may do with azimuths;
//! - [`stops`]: the samples with the ways to measure them, or which of them are out of reach;
//! - [`Route`]: the order, and what it takes beside the naive one;
//! - [`Route::to_csv`], [`Route::to_json`] and [`blank`], the sheet to fill in.
//!
//! On the device [`glimpse_core::gonio::Machine`] goes to the nearest sample each time, by the same
//! times and azimuths; the best order takes looking ahead.

mod axes;
mod exact;
mod machine;
mod points;
mod search;
mod sheet;
mod stop;
#[cfg(test)]
mod tests;
mod visits;
mod ways;

pub use axes::Axes;
pub use machine::{Machine, MachineError};
pub use sheet::blank;
pub use stop::{OutOfReach, Stop, Way, arms_of, stops};
pub use visits::{Order, Route, Visit};
