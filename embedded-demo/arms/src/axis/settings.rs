//! Settings of an axis.

/// Settings of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Settings {
    /// Steps per radian of the arm, microsteps and gear included.
    pub steps_per_radian: f32,
    /// Maximum speed, steps/s.
    pub speed: f32,
    /// Acceleration, steps/s^2.
    pub acceleration: f32,
    /// Speed of the slow approach to the switch, steps/s. The motor must start and stop at it without a ramp.
    pub homing_speed: f32,
    /// Angle at which the switch opens, radians: below `min_angle` or above `max_angle`. The switch stays open beyond
    /// it.
    pub home: f32,
    /// Smallest angle of a sample, radians.
    pub min_angle: f32,
    /// Largest angle of a sample, radians.
    pub max_angle: f32,
    /// Tolerance of the position at which the switch opens, steps.
    pub tolerance: u32,
    /// True if a low direction pin increases the angle.
    pub reversed: bool,
}

impl Settings {
    /// Returns the step nearest to an angle in radians.
    #[must_use]
    #[inline(never)] // saves flash: one copy, instead of one for each arm in unrolled loops
    pub fn steps(&self, angle: f32) -> i32 {
        libm::roundf(angle * self.steps_per_radian) as i32
    }

    /// Returns the angle of a step, radians.
    #[must_use]
    pub fn angle(&self, steps: i32) -> f32 {
        steps as f32 / self.steps_per_radian
    }

    /// Returns the angle near the switch at which the slow approach begins, radians.
    #[must_use]
    #[inline(never)] // saves flash: one copy, instead of one for each arm in unrolled loops
    pub fn near_home(&self) -> f32 {
        self.angle(self.near_home_steps())
    }

    /// Returns the steps between the switch and the far end of the travel.
    #[must_use]
    pub fn travel(&self) -> u32 {
        let far = if self.is_home_low() {
            self.max_angle
        } else {
            self.min_angle
        };
        self.steps(far - self.home).unsigned_abs()
    }

    /// Returns true if the angle increases away from the switch.
    pub(super) fn is_home_low(&self) -> bool {
        self.home < 0.5 * (self.min_angle + self.max_angle)
    }

    /// Returns the distance of a position from the switch, steps.
    pub(super) fn distance(&self, position: i32) -> i32 {
        let steps = position.saturating_sub(self.steps(self.home));
        if self.is_home_low() {
            steps
        } else {
            steps.saturating_neg()
        }
    }

    /// Returns the step of [`Settings::near_home`].
    pub(super) fn near_home_steps(&self) -> i32 {
        let home = self.steps(self.home);
        if self.is_home_low() {
            home.saturating_add(self.clearance())
        } else {
            home.saturating_sub(self.clearance())
        }
    }

    /// Returns the distance from the switch at which the slow approach begins, steps: a hundredth of the travel, but at
    /// least 2 steps, plus the tolerance.
    pub(super) fn clearance(&self) -> i32 {
        let hundredth = self.travel() / 100;
        let clearance = hundredth.max(2).saturating_add(self.tolerance);
        i32::try_from(clearance).unwrap_or(i32::MAX)
    }

    /// Returns the number of steps within which a switch must close when the arm leaves it: a twentieth of the travel,
    /// plus the tolerance.
    pub(super) fn max_release_steps(&self) -> u32 {
        (self.travel() / 20).saturating_add(self.tolerance)
    }

    /// Returns the maximum number of lost steps with which an arm still finds its switch: a tenth of the travel, plus
    /// the tolerance.
    pub(super) fn max_lost_steps(&self) -> u32 {
        (self.travel() / 10).saturating_add(self.tolerance)
    }
}
