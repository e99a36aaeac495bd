//! The state of a run, as saved in a checkpoint.

use glimpse_optimizer::Groups;
use serde::{Deserialize, Serialize};

use super::evolution::Evolution;
use super::scan_budget::INITIAL_WEIGHT;

/// The best values of all groups so far, with their loss.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BestValues {
    /// The loss, as defined by the phase's [`Selection`](super::phase::Selection).
    pub loss: f32,
    /// The values.
    pub values: Groups<Vec<f32>>,
}

/// The state of a run, except the meta-parameters and the optimizer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunState {
    /// The number of completed outer steps of all phases.
    pub done: usize,
    /// The outer loss, smoothed over about 50 steps.
    pub smoothed_loss: f32,
    /// The sum of losses over the steps of the current epoch, including the barriers.
    pub epoch_loss: f32,
    /// The weight of a second of motion, for a run with a [scan budget](super::scan_budget).
    pub motion_weight: f32,
    /// The best values so far.
    pub best: Option<BestValues>,
    /// The state of evolution, during a phase with [`SearchMethod::Evolution`](super::phase::SearchMethod::Evolution).
    pub evolution: Option<Evolution>,
}

impl Default for RunState {
    fn default() -> Self {
        Self {
            done: 0,
            smoothed_loss: 0.0,
            epoch_loss: 0.0,
            motion_weight: INITIAL_WEIGHT,
            best: None,
            evolution: None,
        }
    }
}
