//! Meta-learning of the sample pattern, the initial parameters and the step sizes.

pub mod checkpoint;
pub mod correction;
pub mod initialization;
pub(crate) mod learned;
pub mod outer;
pub mod paper;
pub mod pattern;
pub mod phase;
pub mod prior;
pub mod scan_budget;
pub mod streams;
pub mod tasks;
