//! Meta-learning of the sample pattern, the initial parameters and the step sizes.

pub mod checkpoint;
pub mod completion;
pub mod descent;
pub mod identity;
pub mod initialization;
pub mod learned;
pub mod objective;
pub mod options;
pub mod outer;
pub mod pattern;
pub mod phase;
pub mod plan;
pub mod request;
pub mod ridge;
pub mod run;
pub mod samples;
pub mod scan_budget;
pub mod schedules;
