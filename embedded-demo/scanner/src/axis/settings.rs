//! Settings of an axis.

use core::f32::consts::TAU;

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::gonio::Limits;
use serde::Serialize;

/// The largest step count: `f32` represents the angles of all steps up to it.
const MAX_STEPS: f32 = 4_194_304.0;
/// The smallest travel of an axis, steps.
const MIN_TRAVEL: i32 = 100;

/// Settings of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Settings {
    /// Steps per radian of the arm, microsteps and gear included.
    pub steps_per_radian: f32,
    /// Maximum speed, steps/s.
    pub speed: f32,
    /// Acceleration, steps/s².
    pub acceleration: f32,
    /// Speed of the slow approach to the switch, steps/s. The motor must start and stop at it without a ramp.
    pub homing_speed: f32,
    /// Angle at which the switch opens, radians: below `min_angle` or above `max_angle` by at most a tenth of the travel.
    /// The switch stays open beyond it.
    pub home: f32,
    /// Smallest angle of a sample, radians.
    pub min_angle: f32,
    /// Largest angle of a sample, radians.
    pub max_angle: f32,
    /// Angle at which an optional second switch opens, radians: on the other side of the limits than `home`, by at most a
    /// tenth of the travel. It is normally closed, and in series with the home switch. Both stay open beyond their angles.
    /// With it, a homing from an unknown position checks `steps_per_radian`.
    pub far: Option<f32>,
    /// Tolerance of the step count when the switch opens, steps: from 0 to a twentieth of the travel. A stepper loses
    /// whole electrical cycles, of four full steps each, so half a full step is safe.
    pub tolerance: i32,
    /// True if a low direction pin increases the angle.
    pub reversed: bool,
}

impl Settings {
    /// Part of the travel, a hundredth, within which a switch opens and closes at different positions.
    pub(super) const HYSTERESIS: i32 = 100;
    /// Part of the travel, a twentieth, within which a switch must close when the axis leaves it.
    pub(super) const RELEASE: i32 = 20;
    /// Part of the travel, a tenth: the maximum of lost steps with which an axis still finds its switch.
    pub(crate) const LOST: i32 = 10;

    /// Checks the ranges of all fields.
    ///
    /// # Errors
    /// [`ErrorCode::AxisSettings`] with the name of the first field that is NaN or out of range.
    pub fn validate(&self) -> Result<(), Error> {
        // These forms of the conditions reject NaN too.
        let is_positive = |value: f32| value > 0.0 && value.is_finite();
        let is_countable = |angle: f32| libm::fabsf(angle * self.steps_per_radian) <= MAX_STEPS;
        let gap = self.distance(self.steps(self.clamp(self.home)));
        let tolerances = 0..=self.travel() / 20;
        let far_gap = self.span().saturating_sub(self.travel());
        let is_far_valid = |far| is_countable(far) && far_gap > 0;
        let checks = [
            ("steps_per_radian", is_positive(self.steps_per_radian)),
            ("speed", is_positive(self.speed)),
            ("acceleration", is_positive(self.acceleration)),
            ("homing_speed", is_positive(self.homing_speed)),
            ("min_angle", is_countable(self.min_angle)),
            ("max_angle", is_countable(self.max_angle)),
            ("max_angle", self.min_angle < self.max_angle),
            ("home", is_countable(self.home) && gap > 0),
            ("home", gap <= self.margin(Self::LOST)),
            ("steps_per_radian", self.travel() >= MIN_TRAVEL),
            ("tolerance", tolerances.contains(&self.tolerance)),
            ("far", self.far.is_none_or(is_far_valid)),
            ("far", far_gap <= self.margin(Self::LOST)),
        ];
        let invalid = checks.into_iter().find(|(_, is_valid)| !is_valid);
        let error = |field| Error::in_field(ErrorCode::AxisSettings, field);
        invalid.map_or(Ok(()), |(field, _)| Err(error(field)))
    }

    /// Returns the step nearest to an angle in radians.
    pub fn steps(&self, angle: f32) -> i32 {
        libm::roundf(angle * self.steps_per_radian) as i32
    }

    /// Returns the angle of a step, radians.
    pub fn angle(&self, steps: i32) -> f32 {
        steps as f32 / self.steps_per_radian
    }

    /// Returns an equivalent of this angle within the limits, radians. It may differ by full turns, and at a limit by
    /// [`Limits::TOLERANCE`] or the rounding to a step.
    ///
    /// # Errors
    /// [`ErrorCode::AxisReach`] for NaN and for angles out of reach.
    pub fn reach(&self, angle: f32) -> Result<f32, Error> {
        let tolerance = Limits::TOLERANCE.max(0.6 / self.steps_per_radian);
        let reachable = self.min_angle - tolerance..=self.max_angle + tolerance;
        let middle = 0.5 * (self.min_angle + self.max_angle);
        let turned = angle - TAU * libm::roundf((angle - middle) / TAU);
        let mut angles = [angle, turned].into_iter();
        let turned = angles.find(|angle| reachable.contains(angle));
        let error = Error::with(ErrorCode::AxisReach, [0, angle.to_bits()]);
        Ok(self.clamp(turned.ok_or(error)?))
    }

    /// Returns the angle within the limits that is nearest to this one.
    pub(crate) fn clamp(&self, angle: f32) -> f32 {
        angle.max(self.min_angle).min(self.max_angle)
    }

    /// Returns the limit on the other side than `home`, radians.
    pub(crate) fn end(&self) -> f32 {
        match self.is_home_low() {
            true => self.max_angle,
            false => self.min_angle,
        }
    }

    /// Returns the steps between the switch and the far end of the travel.
    pub fn travel(&self) -> i32 {
        self.distance(self.steps(self.end()))
    }

    /// Returns the steps between the switch and the far switch, or else the far end of the travel.
    pub(crate) fn span(&self) -> i32 {
        self.distance(self.steps(self.far.unwrap_or(self.end())))
    }

    /// Returns true if the angle increases away from the switch.
    pub(crate) fn is_home_low(&self) -> bool {
        self.home < self.min_angle
    }

    /// Returns the distance of a position from the switch, steps.
    pub(crate) fn distance(&self, position: i32) -> i32 {
        let steps = position.saturating_sub(self.steps(self.home));
        steps.saturating_mul(if self.is_home_low() { 1 } else { -1 })
    }

    /// Returns a part of the travel, such as a tenth for 10, but at least 2 steps, plus the tolerance.
    pub(crate) fn margin(&self, part: i32) -> i32 {
        (self.travel() / part).max(2).saturating_add(self.tolerance)
    }
}
