//! The state of a run, as a checkpoint holds it.

use glimpse_optimizer::Groups;
use serde::{Deserialize, Serialize};

use super::evolution::Evolution;

/// Values of all groups, with the loss that they reached.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Best {
    /// The loss, of the kind that the phase keeps by.
    pub loss: f32,
    /// The values.
    pub values: Groups<Vec<f32>>,
}

/// How far a run is: all of its state but meta-parameters and optimizer.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RunState {
    /// Outer steps done, over all phases.
    pub done: usize,
    /// The smoothed outer loss.
    pub loss: f32,
    /// The losses of this epoch's steps, added up, barriers included.
    pub epoch: f32,
    /// The best values so far.
    pub best: Option<Best>,
    /// The evolution under way, in a phase of it.
    pub evolution: Option<Evolution>,
}
