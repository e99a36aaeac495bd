//! A machine with two arms: how long it takes from one place to another.

use std::ops::RangeInclusive;

use glimpse_core::gonio::Limits;

use super::axes::{Axes, wrapped};

/// A machine with two arms, and what it may do with a sample.
///
/// All axes move at once, each at full speed from the first to the last moment, so that a move takes
/// as long as its slowest axis. What the arms might hit on the way is not looked at.
///
/// # Azimuths
///
/// An isotropic sample does not notice when both arms are turned together, so that only the
/// *difference* of the azimuths is given: the two azimuth axes turn against each other, each by its
/// share of the speed, and both arrive together. No choice of azimuths takes less time, since the
/// difference cannot change faster than both axes turn, and none of them depends on where the arms
/// stood before. A difference is changed the short way around.
/// (An arm along the normal could have any azimuth; it is given
/// the pattern's, so that what a move takes never depends on the moves before.)
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Machine {
    /// Degrees per second, 0.001 to 1,000,000. The speed of one azimuth may be 0 where the sample is isotropic:
    /// an axis that the machine does not have.
    pub speeds: Axes,
    /// Seconds at each sample, to come to rest and to read: 0 to 86,400.
    pub settle: f64,
    /// Where the arms stand at first, degrees; polar angles of -180 to 180.
    pub start: Axes,
    /// Where the arms get to.
    pub limits: Limits,
    /// True if the sample is isotropic, so that both azimuths may be turned together.
    pub isotropic: bool,
    /// True if azimuths go around without end. Otherwise their difference, or each of them where the
    /// sample is not isotropic, stays within -180 to 180 degrees, so that no cable winds up.
    pub full_turns: bool,
}

impl Default for Machine {
    /// 10 degrees per second for each axis, half a second at each sample, all axes at 0; no limits; the
    /// sample is isotropic, and azimuths go all around.
    fn default() -> Self {
        Self {
            speeds: Axes::of([10.0; 4]),
            settle: 0.5,
            start: Axes::default(),
            limits: Limits::NONE,
            isotropic: true,
            full_turns: true,
        }
    }
}

/// Speeds that a machine may have, degrees per second: what is beyond is a slip of the pen.
const SPEEDS: RangeInclusive<f64> = 1e-3..=1e6;
/// The longest time at a sample, seconds: a day.
const LONGEST: f64 = 86_400.0;

/// Why there is no such [`Machine`].
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MachineError {
    /// A speed is negative or no number.
    #[error("the speed of {axis} is {value}: give degrees per second, 0.001 to 1,000,000")]
    Speed {
        /// The axis.
        axis: &'static str,
        /// What was given.
        value: f64,
    },
    /// No axis changes the difference of the azimuths.
    #[error(
        "the speeds of phi_i and phi_o are both 0, so that no azimuth changes: give one of them in \
         degrees per second"
    )]
    NoAzimuth,
    /// The sample is not isotropic, and an azimuth does not turn.
    #[error(
        "the speed of {axis} is 0, but a sample that is not isotropic needs both azimuths: give it \
         in degrees per second"
    )]
    MissingAzimuth {
        /// The axis.
        axis: &'static str,
    },
    /// The time at each sample is negative or no number.
    #[error("the time at each sample is {0}: give seconds, 0 to 86,400")]
    Settle(f64),
    /// A starting position is no angle.
    #[error("the start of {axis} is {value}: give {range}")]
    Start {
        /// The axis.
        axis: &'static str,
        /// What was given.
        value: f64,
        /// What may be given.
        range: &'static str,
    },
    /// Without full turns the arms cannot have come to where they start.
    #[error(
        "the azimuths start {0} degrees apart, but without full turns no more than 180 are possible: \
         give phi_i and phi_o that are nearer to each other"
    )]
    WoundUp(f64),
    /// The limits are none.
    #[error(transparent)]
    Limits(#[from] glimpse_core::gonio::LimitsError),
}

impl Machine {
    /// Looks whether there can be such a machine.
    ///
    /// # Errors
    /// Which field is out of its range, and what is in it.
    pub fn validate(&self) -> Result<(), MachineError> {
        self.limits.validate()?;
        for (axis, value) in Axes::NAMES.into_iter().zip(self.speeds.values()) {
            let may_be_absent = axis.starts_with("phi") && value == 0.0;
            if !(SPEEDS.contains(&value) || may_be_absent) {
                return Err(MachineError::Speed { axis, value });
            }
            if may_be_absent && !self.isotropic {
                return Err(MachineError::MissingAzimuth { axis });
            }
        }
        if self.speeds.phi_i + self.speeds.phi_o == 0.0 {
            return Err(MachineError::NoAzimuth);
        }
        if !(0.0..=LONGEST).contains(&self.settle) {
            return Err(MachineError::Settle(self.settle));
        }
        // More turns than a machine has are a slip of the pen, and would cost digits.
        const MOST_AZIMUTH: f64 = 3_600.0;
        for (axis, value) in Axes::NAMES.into_iter().zip(self.start.values()) {
            let (most, range) = match axis.starts_with("phi") {
                true if !self.isotropic && !self.full_turns => (180.0, "degrees from -180 to 180"),
                true => (MOST_AZIMUTH, "degrees, no more than ten turns"),
                false => (180.0, "degrees from -180 to 180"),
            };
            if !(-most..=most).contains(&value) {
                return Err(MachineError::Start { axis, value, range });
            }
        }
        let apart = (self.start.phi_o - self.start.phi_i).abs();
        if self.isotropic && !self.full_turns && apart > 180.0 {
            return Err(MachineError::WoundUp(apart));
        }
        Ok(())
    }

    /// The same machine when none of its freedom is used: azimuths as the pattern has them. One that
    /// lacks an azimuth axis keeps to the difference.
    #[must_use]
    pub fn naive(&self) -> Self {
        let lacks_axis = self.speeds.phi_i == 0.0 || self.speeds.phi_o == 0.0;
        Self {
            isotropic: self.isotropic && lacks_axis,
            ..*self
        }
    }

    /// Where arms stand, told in seconds that each axis takes from 0; where the sample is isotropic,
    /// one of the difference of azimuths instead of both. Angles are taken within -180 to 180.
    ///
    /// The time from one place to another is the largest difference, each modulo
    /// [`turn`](Self::turn).
    pub(super) fn seconds(&self, arms: &Axes) -> [f64; 4] {
        let speeds = &self.speeds;
        let [phi_i, phi_o] = match self.isotropic {
            true => [
                wrapped(arms.phi_o - arms.phi_i) / (speeds.phi_i + speeds.phi_o),
                0.0,
            ],
            false => [
                wrapped(arms.phi_i) / speeds.phi_i,
                wrapped(arms.phi_o) / speeds.phi_o,
            ],
        };
        [
            arms.theta_i / speeds.theta_i,
            arms.theta_o / speeds.theta_o,
            phi_i,
            phi_o,
        ]
    }

    /// How many seconds a full turn takes by each of [`seconds`](Self::seconds); infinite for what does
    /// not go around.
    pub(super) fn turn(&self) -> [f64; 4] {
        const NEVER: f64 = f64::INFINITY;
        let speeds = &self.speeds;
        match (self.full_turns, self.isotropic) {
            (false, _) => [NEVER; 4],
            (true, true) => [NEVER, NEVER, 360.0 / (speeds.phi_i + speeds.phi_o), NEVER],
            (true, false) => [NEVER, NEVER, 360.0 / speeds.phi_i, 360.0 / speeds.phi_o],
        }
    }

    /// Where the axes stand after a move, degrees. `from` and `to` are places, whose azimuths are
    /// known but for a turn; `at` is where the axes stood at `from`, turns and all.
    #[must_use]
    pub fn arrival(&self, at: &Axes, from: &Axes, to: &Axes) -> Axes {
        let short = |by: f64| match self.full_turns {
            true => wrapped(by),
            false => by,
        };
        let [by_i, by_o] = match self.isotropic {
            true => {
                let apart = |arms: &Axes| wrapped(arms.phi_o - arms.phi_i);
                let by = short(apart(to) - apart(from));
                let by_i = -by * self.speeds.phi_i / (self.speeds.phi_i + self.speeds.phi_o);
                [by_i, by + by_i]
            }
            false => [(from.phi_i, to.phi_i), (from.phi_o, to.phi_o)]
                .map(|(from, to)| short(wrapped(to) - wrapped(from))),
        };
        Axes {
            theta_i: to.theta_i,
            phi_i: at.phi_i + by_i,
            theta_o: to.theta_o,
            phi_o: at.phi_o + by_o,
        }
    }
}

#[cfg(test)]
mod tests {
    use glimpse_core::gonio::LimitsError;

    use super::*;

    type Change = fn(&mut Machine);

    #[test]
    fn machines_that_cannot_be_are_refused_by_name() {
        let good = Machine::default();
        assert_eq!(good.validate(), Ok(()));
        let speed = |axis, value| MachineError::Speed { axis, value };
        let cases: [(Change, MachineError); 8] = [
            (|of| of.speeds.theta_i = 0.0, speed("theta_i", 0.0)),
            (|of| of.speeds.theta_o = -1.0, speed("theta_o", -1.0)),
            (
                |of| (of.speeds.phi_i, of.speeds.phi_o) = (0.0, 0.0),
                MachineError::NoAzimuth,
            ),
            (
                |of| (of.isotropic, of.speeds.phi_i) = (false, 0.0),
                MachineError::MissingAzimuth { axis: "phi_i" },
            ),
            (|of| of.settle = -0.5, MachineError::Settle(-0.5)),
            (
                |of| (of.full_turns, of.start.phi_o) = (false, 190.0),
                MachineError::WoundUp(190.0),
            ),
            (
                |of| of.limits.max_theta_i = 2.0,
                MachineError::Limits(LimitsError::MaxThetaI),
            ),
            (
                |of| of.speeds.phi_o = f64::INFINITY,
                speed("phi_o", f64::INFINITY),
            ),
        ];
        for (change, expected) in cases {
            let mut machine = good;
            change(&mut machine);
            assert_eq!(machine.validate(), Err(expected));
        }
        let starts: [(&str, Change); 2] = [
            ("theta_i", |of| of.start.theta_i = 181.0),
            ("phi_i", |of| of.start.phi_i = f64::INFINITY),
        ];
        for (expected, change) in starts {
            let mut machine = good;
            change(&mut machine);
            let error = machine.validate().expect_err("it is out of range");
            let is_named = matches!(error, MachineError::Start { axis, .. } if axis == expected);
            assert!(is_named, "{error}");
        }
        let mut machine = good;
        machine.speeds.phi_o = f64::NAN;
        let error = machine.validate().expect_err("it is not a speed");
        let is_speed =
            matches!(error, MachineError::Speed { axis: "phi_o", value } if value.is_nan());
        assert!(is_speed, "{error}");
    }
}
