//! The position of a machine's arms during a scan whose order is not planned.

use glimpse_core::geometry::Angles;

use super::arms::arms_in_degrees;
use super::machine::{AxisSeconds, Machine, move_seconds};

/// The shortest time of a reading, in seconds.
const MIN_SECONDS: f64 = 1e-3;

/// The position of a machine's arms.
#[derive(Clone, Debug)]
pub struct Position {
    machine: Machine,
    at: AxisSeconds,
}

impl Position {
    /// Begins at the start position. The machine must be [valid](Machine::validate).
    #[must_use]
    pub fn new(machine: Machine) -> Self {
        Self {
            at: machine.axis_seconds(&Machine::START),
            machine,
        }
    }

    /// Returns the time to move to a direction and to read there, in seconds, at least 0.001.
    #[must_use]
    pub fn seconds_to(&self, angles: Angles<f32>) -> f64 {
        let to = self.machine.axis_seconds(&arms_in_degrees(angles));
        let seconds = move_seconds(self.machine.turn_seconds(), &self.at, &to);
        (seconds + self.machine.settle).max(MIN_SECONDS)
    }

    /// Moves to a direction. Returns the time to move and to read, in seconds.
    pub fn move_to(&mut self, angles: Angles<f32>) -> f64 {
        let seconds = self.seconds_to(angles);
        self.at = self.machine.axis_seconds(&arms_in_degrees(angles));
        seconds
    }
}
