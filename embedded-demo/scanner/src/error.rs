//! The error of a motion.

use glimpse_core::error::Error;

/// An error of an axis, or of the motion of several axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MotionError {
    /// This field of an axis' settings is NaN or out of its range.
    Settings(&'static str),
    /// The largest polar angles or the minimum separation are out of range.
    Limits(Error),
    /// Lamp and sensor may collide at home: place the lamp's switch near the normal, the sensor's near the horizon.
    HomeTooClose,
    /// The position is unknown since power-up or an error: home the axis.
    NotHomed,
    /// The axis is moving: wait until it has arrived.
    Moving,
    /// This angle, radians, is NaN or beyond the axis' limits.
    OutOfReach(f32),
    /// No route keeps lamp and sensor apart: check the limits of the azimuths.
    NoSafeRoute,
    /// The switch did not open within the remaining travel: check the motor, the driver's supply, and the switch's
    /// wires for a short circuit.
    HomeNotFound,
    /// The switch did not close when the axis left it: check the switch, its wires for a break, and `reversed`.
    HomeStuck,
    /// The switch opened during a move, at this step count from home: check for lost steps, a collision, and the
    /// switch's wires for a break.
    SwitchOpened(i32),
    /// The contact of the switch does not settle: check the contact, and shield its wires.
    SwitchBounces,
    /// A pin could not be read or written: check its configuration.
    Pin,
}

impl MotionError {
    /// Returns the name of the error.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Settings(_) => "Settings",
            Self::Limits(_) => "Limits",
            Self::HomeTooClose => "HomeTooClose",
            Self::NotHomed => "NotHomed",
            Self::Moving => "Moving",
            Self::OutOfReach(_) => "OutOfReach",
            Self::NoSafeRoute => "NoSafeRoute",
            Self::HomeNotFound => "HomeNotFound",
            Self::HomeStuck => "HomeStuck",
            Self::SwitchOpened(_) => "SwitchOpened",
            Self::SwitchBounces => "SwitchBounces",
            Self::Pin => "Pin",
        }
    }
}
