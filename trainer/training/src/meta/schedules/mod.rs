//! The training schedules: the phases of each, in order.

pub mod paper;
pub mod prior;
