//! Errors of an axis.

use core::fmt;

/// An error of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum AxisError {
    /// The arm has not been homed since power-up or since its last error.
    NotHomed,
    /// The arm is moving.
    Moving,
    /// The angle is NaN or beyond the axis' limits.
    OutOfReach {
        /// The angle, radians.
        angle: f32,
    },
    /// The switch did not open within the remaining travel.
    HomeNotFound,
    /// The switch did not close when the arm left it: it is stuck, or its wire is broken.
    HomeStuck,
    /// The switch opened during a move, far from home.
    SwitchOpened {
        /// Distance from the switch according to the step count, in steps.
        steps: i32,
    },
    /// The contact of the switch does not settle.
    SwitchBounces,
    /// A pin could not be read or written.
    Pin,
}

impl fmt::Display for AxisError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotHomed => f.write_str("its position is unknown: home it first"),
            Self::Moving => f.write_str("it is moving: wait until it has arrived"),
            Self::OutOfReach { angle } => write!(f, "the angle {angle} rad is beyond its limits: change the sample, or `min_angle` and `max_angle`"),
            Self::HomeNotFound => f.write_str(
                "its home switch does not open within its travel: check the motor, the driver's supply, and the switch's wires for a short circuit",
            ),
            Self::HomeStuck => f.write_str(
                "its home switch does not close: check the switch, its wires for a break, and `reversed`",
            ),
            Self::SwitchOpened { steps } => write!(
                f,
                "its home switch opened {steps} steps too early: check for lost steps, for a collision, and the switch's wires for a break"
            ),
            Self::SwitchBounces => f.write_str(
                "its home switch does not settle: check its contact, and shield its wires",
            ),
            Self::Pin => f.write_str("one of its pins could not be read or written: check the pins' configuration"),
        }
    }
}

impl core::error::Error for AxisError {}
