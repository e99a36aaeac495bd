//! Planning of the order and the poses in which a machine's arms measure a recipe's samples.
//!
//! - [`Machine`]: the speeds of its axes and its freedom of azimuths;
//! - [`stops`]: the samples with their poses, or the unreachable samples;
//! - [`Route`]: the visits, with the times of this route and of the naive one;
//! - [`Route::to_csv`], [`Route::to_json`] and [`blank_sheet`]: export.
//!
//! On a device [`glimpse_core::gonio::Machine`] always moves to the nearest sample, with the same travel times and
//! azimuths. The fastest order requires planning ahead.

mod axes;
mod exact;
mod machine;
mod points;
mod poses;
mod search;
mod sheet;
mod stop;
#[cfg(test)]
mod tests;
mod visit;

pub use axes::Axes;
pub use machine::{Machine, MachineError};
pub use sheet::blank_sheet;
pub use stop::{OutOfReach, Pose, Stop, axes_from_angles, stops};
pub use visit::{Order, Route, Visit};
