//! Planning of a route: the order in which the arms of a machine measure a recipe's samples.
//!
//! - [`TimedMachine`]: the speeds and limits of the axes, and the treatment of azimuths;
//! - [`stops`]: the positions of the samples, or the unreachable samples;
//! - [`PlanArgs`]: a request for a plan;
//! - [`Route`]: the visits, with their times;
//! - [`Route::to_csv`], [`Route::to_json`] and [`Route::blank_sheet`]: export.
//!
//! A device's [`glimpse_core::gonio::Machine`] has the same travel times and azimuths, except in one plane, but always moves to the nearest
//! sample. The fastest order has to be planned before the scan.

mod arms;
mod machine;
mod request;
mod search;
mod sheet;
mod stop;
#[cfg(test)]
mod tests;
mod visit;

pub(crate) use arms::wrapped;
pub use arms::{arms_at, arms_in_degrees, axes_of, axis_speeds, relative_arms};
pub use machine::{MachineError, Position, TimedMachine, move_seconds};
pub use request::{LimitArgs, MachineArgs, PlanArgs, SpeedArgs};
pub use sheet::blank_directions;
pub use stop::{OutOfReach, PlanError, stops};
pub use visit::{Order, Route, Visit};
