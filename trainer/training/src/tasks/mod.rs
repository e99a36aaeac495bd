//! Tasks of training: augmented materials, their values at pools of directions, and simulated readings.
//!
//! A [task](task::TrainingTask) is a training material, filtered, mixed with another material, each with a
//! [wider or narrower highlight](highlight_warp::HighlightWarp), and multiplied by a smooth field. Its readings are noisy,
//! and some may be missing.

pub mod highlight_warp;
pub(crate) mod material;
pub mod pool;
pub mod reading;
pub mod samples;
pub mod task;
