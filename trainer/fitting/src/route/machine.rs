//! A machine with two arms, their position, and the time of their moves.

use std::ops::RangeInclusive;

use glimpse_core::geometry::{Angles, Arms};
use glimpse_core::gonio::Limits;
use glimpse_kernels::dual::RealScalar;
use glimpse_materials::setting::Name;

use super::arms::{arms_in_degrees, swung, wrapped};

/// A machine with two arms.
///
/// All axes move at the same time. Acceleration is neglected: the time of a move is that of its slowest axis at full
/// speed.
/// Collisions during a move are not checked.
///
/// # Azimuths
///
/// The sample is isotropic, so its BRDF depends only on the *difference* of the azimuths. The two azimuth axes turn in
/// opposite directions, in proportion to their speeds, and arrive at the same time. No other choice of azimuths takes
/// less time, because the difference cannot change faster than both axes together, and the times do not depend on
/// earlier moves. The difference changes in the shorter direction.
///
/// An arm along the normal could have any azimuth. It keeps the pattern's azimuth, so that the time of a move never
/// depends on earlier moves.
///
/// # One plane
///
/// With the limit `in_plane`, the machine has no azimuths. The sensor's arm swings through the normal to the light's side, where
/// theta_o is negative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimedMachine {
    /// The axis speeds in degrees per second, 0.001 to 1,000,000. One azimuth may have the speed 0, which means that the
    /// machine lacks that axis. In one plane both have.
    pub speeds: Arms<f64>,
    /// The time to settle and to read at each sample, in seconds, 0 to 86,400.
    pub settle: f64,
    /// The limits of the arms.
    pub limits: Limits,
    /// True if azimuths turn without a limit. Otherwise their difference stays within -180 to 180 degrees, so that no
    /// cable winds up.
    pub full_turns: bool,
}

impl Default for TimedMachine {
    /// 10 degrees per second for each axis, 0.5 s at each sample, no limits, and full turns.
    fn default() -> Self {
        Self {
            speeds: Arms::from_array([10.0; 4]),
            settle: 0.5,
            limits: Limits::NONE,
            full_turns: true,
        }
    }
}

/// The range of speeds, in degrees per second. Other values are probably typing errors.
const SPEEDS: RangeInclusive<f64> = 1e-3..=1e6;
/// The shortest time of a reading, in seconds.
const MIN_SECONDS: f64 = 1e-3;
/// The longest time at a sample, in seconds: one day.
const MAX_SETTLE: f64 = 86_400.0;

/// An error of an invalid [`TimedMachine`].
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MachineError {
    /// A speed is out of range or NaN.
    #[error(
        "{}: the speed of {axis} is {value}; give degrees per second, 0.001 to 1,000,000",
        Name::SPEED
    )]
    Speed {
        /// The axis.
        axis: &'static str,
        /// The invalid value.
        value: f64,
    },
    /// The speeds of both azimuths are 0.
    #[error(
        "{}: the speeds of phi_i and phi_o are both 0; give at least one of them, 0.001 to 1,000,000 degrees per second, or \
         {} for a machine without them",
        Name::SPEED,
        Name::IN_PLANE
    )]
    NoAzimuth,
    /// A setting of azimuths, for a machine in one plane.
    #[error(
        "{0} states something of azimuths, which a machine with {in_plane} does not have: leave that out",
        in_plane = Name::IN_PLANE
    )]
    Azimuth(Name<'static>),
    /// The time at each sample is out of range or NaN.
    #[error(
        "{name}: the time at each sample is {0}; give seconds, 0 to 86,400",
        name = Name::SETTLE
    )]
    Settle(f64),
    /// The angle of a limit is out of range or NaN.
    #[error("{limit} must be above 0 and at most {max} degrees, not {degrees}")]
    Angle {
        /// The limit.
        limit: Name<'static>,
        /// The invalid value.
        degrees: f32,
        /// The largest valid value.
        max: f32,
    },
    /// The limits are invalid.
    #[error(
        "{theta_i}, {theta_o} and {separation} are inconsistent: {0}",
        theta_i = Name::MAX_THETA_I,
        theta_o = Name::MAX_THETA_O,
        separation = Name::MIN_SEPARATION
    )]
    Limits(#[from] glimpse_core::error::Error),
}

/// The result of [`TimedMachine::axis_seconds`].
pub(crate) type AxisSeconds<S = f64> = [S; 3];

/// Returns the time of a move from one [`TimedMachine::axis_seconds`] to another, given [`TimedMachine::turn_seconds`].
#[inline]
pub fn move_seconds<S: RealScalar>(turn: f64, from: &AxisSeconds<S>, to: &AxisSeconds<S>) -> S {
    let mut moves = *to;
    for (change, from) in moves.iter_mut().zip(from) {
        *change = *change - *from;
        *change = change.max(-*change);
    }
    let [theta_i, theta_o, direct] = moves;
    let azimuth = direct.min(S::constant(turn) - direct);
    theta_i.max(theta_o).max(azimuth)
}

impl TimedMachine {
    /// The position at the start of a scan, in degrees: both arms along the normal, with opposite azimuths.
    pub const START: Arms<f64> = Arms {
        theta_i: 0.0,
        phi_i: 0.0,
        theta_o: 0.0,
        phi_o: 180.0,
    };

    /// Checks the ranges of all fields.
    ///
    /// # Errors
    /// The first field that is out of range, and its value.
    pub fn validate(&self) -> Result<(), MachineError> {
        self.limits.validate()?;
        for (axis, value) in Arms::NAMES.into_iter().zip(self.speeds.to_array()) {
            let is_absent = axis.starts_with("phi") && value == 0.0;
            if !(SPEEDS.contains(&value) || is_absent) {
                return Err(MachineError::Speed { axis, value });
            }
        }
        let has_azimuth = self.speeds.phi_i + self.speeds.phi_o > 0.0;
        match (self.limits.in_plane, has_azimuth) {
            (true, true) => return Err(MachineError::Azimuth(Name::SPEED)),
            (false, false) => return Err(MachineError::NoAzimuth),
            _ => {}
        }
        if !(0.0..=MAX_SETTLE).contains(&self.settle) {
            return Err(MachineError::Settle(self.settle));
        }
        Ok(())
    }

    /// Converts a position to the seconds that each axis takes from 0: theta_i, theta_o, and the difference of the
    /// azimuths, wrapped to -180 to 180 degrees. In one plane the last one is 0.
    pub fn axis_seconds<S: RealScalar>(&self, arms: &Arms<S>) -> AxisSeconds<S> {
        let speeds = &self.speeds;
        let seconds = |angle: S, speed: f64| angle * S::constant(1.0 / speed);
        if self.limits.in_plane {
            let arms = swung(arms);
            let theta_o = seconds(arms.theta_o, speeds.theta_o);
            return [
                seconds(arms.theta_i, speeds.theta_i),
                theta_o,
                S::constant(0.0),
            ];
        }
        let azimuth = wrapped(arms.phi_o - arms.phi_i);
        [
            seconds(arms.theta_i, speeds.theta_i),
            seconds(arms.theta_o, speeds.theta_o),
            seconds(azimuth, speeds.phi_i + speeds.phi_o),
        ]
    }

    /// Returns the seconds that a full turn of the difference of the azimuths takes; infinite without full turns.
    pub fn turn_seconds(&self) -> f64 {
        if self.full_turns {
            360.0 / (self.speeds.phi_i + self.speeds.phi_o)
        } else {
            f64::INFINITY
        }
    }

    /// Returns the axis positions after a move, in degrees. `from` and `to` are poses with azimuths modulo a full turn.
    /// `position` holds the axis positions at `from` with all turns.
    #[must_use]
    pub fn arrival(&self, position: &Arms<f64>, from: &Arms<f64>, to: &Arms<f64>) -> Arms<f64> {
        if self.limits.in_plane {
            return swung(to);
        }
        let difference = |arms: &Arms<f64>| wrapped(arms.phi_o - arms.phi_i);
        let mut change = difference(to) - difference(from);
        if self.full_turns {
            change = wrapped(change);
        }
        let change_i = -change * self.speeds.phi_i / (self.speeds.phi_i + self.speeds.phi_o);
        Arms {
            theta_i: to.theta_i,
            phi_i: position.phi_i + change_i,
            theta_o: to.theta_o,
            phi_o: position.phi_o + change + change_i,
        }
    }
}

/// The position of a machine's arms during a scan whose order is not planned.
#[derive(Clone, Debug)]
pub struct Position {
    machine: TimedMachine,
    at: AxisSeconds,
}

impl Position {
    /// Begins at the start position. The machine must be [valid](TimedMachine::validate).
    #[must_use]
    pub fn new(machine: TimedMachine) -> Self {
        Self {
            at: machine.axis_seconds(&TimedMachine::START),
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The command line refuses these before they reach a machine, Python does not.
    #[test]
    fn rejects_speeds_that_are_not_finite() {
        for speed in [f64::NAN, f64::INFINITY] {
            let mut machine = TimedMachine::default();
            machine.speeds.phi_o = speed;
            let error = machine.validate();
            let is_named = matches!(error, Err(MachineError::Speed { axis: "phi_o", .. }));
            assert!(is_named, "{error:?}");
        }
    }
}
