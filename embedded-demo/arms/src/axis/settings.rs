//! What an arm is like.

/// What an arm is like.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Settings {
    /// Steps of the motor, microsteps and gear included, to a radian of the arm.
    pub steps_per_radian: f32,
    /// The fastest it goes, steps/s.
    pub speed: f32,
    /// How fast it gets there, steps/s^2.
    pub acceleration: f32,
    /// Steps/s at which it can start and stop at once: for the last approach to the switch.
    pub homing_speed: f32,
    /// Where the switch closes, radians. Below that angle it stays closed.
    pub home: f32,
    /// The smallest angle that it may go to, radians; larger than `home`.
    pub least: f32,
    /// The largest angle that it may go to, radians.
    pub largest: f32,
    /// How far the switch may be from where it closed before, in steps.
    pub tolerance: u32,
    /// True if the direction pin is low where the angle grows.
    pub reversed: bool,
}

impl Settings {
    /// The step that is nearest to an angle in radians.
    #[must_use]
    pub fn steps(&self, angle: f32) -> i32 {
        libm::roundf(angle * self.steps_per_radian) as i32
    }

    /// The angle of a step, radians.
    #[must_use]
    pub fn angle(&self, steps: i32) -> f32 {
        steps as f32 / self.steps_per_radian
    }

    /// Steps from the switch at which the last approach begins: a hundredth of the way, and more
    /// than the switch may be off.
    pub(super) fn clearance(&self) -> i32 {
        let hundredth = self.steps((self.largest - self.home) / 100.0);
        hundredth.max(2).saturating_add(self.tolerance as i32)
    }

    /// More steps than there are from end to end.
    pub(super) fn whole_way(&self) -> u32 {
        let way = self.steps(self.largest - self.home).unsigned_abs();
        way.saturating_add(way / 4).saturating_add(100)
    }
}
