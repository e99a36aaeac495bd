//! Settings of an axis.

/// Settings of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Settings {
    /// Steps of the motor, microsteps and gear included, to a radian of the arm.
    pub steps_per_radian: f32,
    /// The largest speed, steps/s.
    pub speed: f32,
    /// The acceleration up to that speed, steps/s^2.
    pub acceleration: f32,
    /// Steps/s at which it can start and stop at once: for the last approach to the switch.
    pub homing_speed: f32,
    /// The angle at which the switch opens, radians: below `least` or above `largest`. The switch
    /// stays open beyond it.
    pub home: f32,
    /// The smallest angle of a sample, radians.
    pub least: f32,
    /// The largest angle of a sample, radians.
    pub largest: f32,
    /// The spread of the angles at which the switch opens, in steps.
    pub tolerance: u32,
    /// True if the direction pin is low where the angle grows.
    pub reversed: bool,
}

impl Settings {
    /// The step that is nearest to an angle in radians.
    #[must_use]
    #[inline(never)] // smaller: loops over the arms are unrolled
    pub fn steps(&self, angle: f32) -> i32 {
        libm::roundf(angle * self.steps_per_radian) as i32
    }

    /// The angle of a step, radians.
    #[must_use]
    pub fn angle(&self, steps: i32) -> f32 {
        steps as f32 / self.steps_per_radian
    }

    /// The angle near the switch, radians, from which an arm approaches it slowly.
    #[must_use]
    #[inline(never)] // smaller: loops over the arms are unrolled
    pub fn near_home(&self) -> f32 {
        self.angle(self.near_home_steps())
    }

    /// Steps between the switch and the far end of the travel.
    #[must_use]
    pub fn travel(&self) -> u32 {
        let far = if self.is_home_low() {
            self.largest
        } else {
            self.least
        };
        self.steps(far - self.home).unsigned_abs()
    }

    /// Returns true if the angle grows away from the switch.
    pub(super) fn is_home_low(&self) -> bool {
        self.home < 0.5 * (self.least + self.largest)
    }

    /// Steps of a position from the switch, away from it.
    pub(super) fn distance(&self, position: i32) -> i32 {
        let steps = position.saturating_sub(self.steps(self.home));
        if self.is_home_low() {
            steps
        } else {
            steps.saturating_neg()
        }
    }

    /// The step of [`Settings::near_home`].
    pub(super) fn near_home_steps(&self) -> i32 {
        let home = self.steps(self.home);
        if self.is_home_low() {
            home.saturating_add(self.clearance())
        } else {
            home.saturating_sub(self.clearance())
        }
    }

    /// Steps from the switch at which the last approach begins: a hundredth of the travel, and more
    /// than the tolerance.
    pub(super) fn clearance(&self) -> i32 {
        let hundredth = self.travel() / 100;
        let clearance = hundredth.max(2).saturating_add(self.tolerance);
        i32::try_from(clearance).unwrap_or(i32::MAX)
    }

    /// Steps after which a switch has to close when the arm leaves it: a twentieth of the travel.
    pub(super) fn max_release(&self) -> u32 {
        (self.travel() / 20).saturating_add(self.tolerance)
    }

    /// Steps that an arm may have lost when it comes home: a tenth of the travel. One that has lost
    /// more does not find its switch.
    pub(super) fn max_slip(&self) -> u32 {
        (self.travel() / 10).saturating_add(self.tolerance)
    }
}
