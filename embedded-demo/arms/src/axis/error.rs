//! What goes wrong with an arm.

use core::fmt;

/// What went wrong with an arm.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum AxisError {
    /// It was not sent home since it was switched on or slipped.
    NotHomed,
    /// It moves.
    Moving,
    /// The angle is NaN or beyond its limits.
    OutOfReach {
        /// Radians.
        angle: f32,
    },
    /// It went all the way and more, and the switch did not close.
    HomeNotFound,
    /// It went all the way and more, and the switch did not open.
    HomeStuck,
    /// The switch closed where the arm should be far from it.
    Slipped {
        /// Steps that it should be away from it.
        steps: i32,
    },
    /// A pin could not be read or written.
    Pin,
}

impl fmt::Display for AxisError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotHomed => f.write_str("it does not know where it is: send it home first"),
            Self::Moving => f.write_str("it moves: wait until it has arrived"),
            Self::OutOfReach { angle } => write!(f, "{angle} rad is beyond its limits"),
            Self::HomeNotFound => f.write_str(
                "its home switch does not close: look at motor, driver's supply and the switch's wires",
            ),
            Self::HomeStuck => f.write_str(
                "its home switch does not open: look at the switch, and at `reversed`",
            ),
            Self::Slipped { steps } => write!(
                f,
                "its home switch closed {steps} steps too early: it lost steps or hit something"
            ),
            Self::Pin => f.write_str("a pin of it could not be read or written"),
        }
    }
}

impl core::error::Error for AxisError {}
