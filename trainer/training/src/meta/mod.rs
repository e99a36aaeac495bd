//! Meta-learning: where to measure, from which parameters to start, and how far to step.

pub mod augmentation;
pub mod checkpoint;
pub mod completion;
pub mod descent;
pub mod evolution;
pub mod identity;
pub mod learned;
pub mod linear;
pub mod objective;
pub mod options;
pub mod outer;
pub mod pattern;
pub mod phase;
pub mod plan;
pub mod pool;
pub mod run;
pub mod schedules;
pub mod start;
pub mod state;
