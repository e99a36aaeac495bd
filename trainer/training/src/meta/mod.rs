//! Meta-learning of the sample pattern, the initial parameters and the step sizes.

pub mod checkpoint;
pub mod correction;
pub mod expected_loss;
pub mod identity;
pub mod initialization;
pub(crate) mod learned;
pub mod options;
pub mod outer;
pub mod paper;
pub mod pattern;
pub mod phase;
pub mod prior;
mod quantize;
pub mod scan_budget;
pub(crate) mod sections;
pub mod streams;
pub mod tasks;
