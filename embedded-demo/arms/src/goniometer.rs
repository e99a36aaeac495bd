//! A goniometer: several arms that move at the same time, and are homed one after the other.
//!
//! [`crate::route`] ensures that lamp and sensor do not collide.

use core::fmt;

use embedded_hal::digital::{InputPin, OutputPin};

use crate::axis::{Axis, AxisError, Motion};

/// An error of one arm.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ArmError {
    /// Number of the arm, in the order of [`Goniometer::new`].
    pub arm: u8,
    /// Error of the arm.
    pub error: AxisError,
}

impl fmt::Display for ArmError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "arm {}: {}", self.arm, self.error)
    }
}

impl core::error::Error for ArmError {}

/// Lost steps of an arm, which its homing has found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LostSteps {
    /// Number of the arm.
    pub arm: u8,
    /// Steps by which its count is ahead of its position.
    pub steps: i32,
}

/// A goniometer of `ARMS` arms. A scan uses four: theta_i, phi_i, theta_o, phi_o.
#[derive(Debug)]
pub struct Goniometer<S, D, H, const ARMS: usize> {
    arms: [Axis<S, D, H>; ARMS],
    /// Homing order of the arms, and the index of the present arm in it.
    homing: Option<([usize; ARMS], usize)>,
}

impl<S: OutputPin, D: OutputPin, H: InputPin, const ARMS: usize> Goniometer<S, D, H, ARMS> {
    /// Creates a goniometer whose arms are at unknown positions.
    pub fn new(arms: [Axis<S, D, H>; ARMS]) -> Self {
        Self { arms, homing: None }
    }

    /// Returns the arms.
    pub fn arms(&self) -> &[Axis<S, D, H>; ARMS] {
        &self.arms
    }

    /// Returns the positions according to the step counts. None while one of them is unknown.
    pub fn positions(&self) -> Option<[i32; ARMS]> {
        let homed = self.arms.iter().all(Axis::is_homed);
        homed.then(|| self.arms.each_ref().map(|arm| arm.position()))
    }

    /// Assumes step counts from before a reset. The next homing checks them.
    pub fn assume(&mut self, positions: [i32; ARMS]) {
        for (arm, position) in self.arms.iter_mut().zip(positions) {
            arm.assume(position);
        }
    }

    /// Checks that a sample's angles, radians, are within the limits of each axis.
    ///
    /// # Errors
    /// The first arm whose angle is out of its limits.
    pub fn check(&self, angles: [f32; ARMS]) -> Result<(), ArmError> {
        for ((number, arm), angle) in (0..).zip(&self.arms).zip(angles) {
            arm.check(angle).map_err(at_arm(number))?;
        }
        Ok(())
    }

    /// Sends the arms to angles in radians, all at the same time; see [`Axis::go_to`].
    ///
    /// # Errors
    /// If an arm is moving, is not homed, or cannot reach its angle. No arm moves then.
    pub fn go_to(&mut self, angles: [f32; ARMS]) -> Result<(), ArmError> {
        for ((number, arm), angle) in (0..).zip(&self.arms).zip(angles) {
            arm.check_move(angle).map_err(at_arm(number))?;
        }
        for ((number, arm), angle) in (0..).zip(&mut self.arms).zip(angles) {
            if let Err(error) = arm.go_to(angle) {
                self.stop();
                return Err(ArmError { arm: number, error });
            }
        }
        Ok(())
    }

    /// Sends the arms onto their home switches, one after the other in this order.
    ///
    /// # Errors
    /// If an arm is moving.
    pub fn go_home(&mut self, order: [usize; ARMS]) -> Result<(), ArmError> {
        self.homing = Some((order, 0));
        self.send_home(order, 0)
    }

    fn send_home(&mut self, order: [usize; ARMS], index: usize) -> Result<(), ArmError> {
        let number = order.get(index).copied().unwrap_or(ARMS);
        match self.arms.get_mut(number) {
            Some(arm) => arm.go_home().map_err(at_arm(number as u8)),
            None => Ok(()),
        }
    }

    /// Returns the lost steps that the last homing has found.
    pub fn lost_steps(&self) -> impl Iterator<Item = LostSteps> + '_ {
        let lost = (0..).zip(self.arms.iter().map(Axis::lost_steps));
        lost.filter_map(|(arm, steps)| steps.map(|steps| LostSteps { arm, steps }))
    }

    /// Stops all arms. They must be homed again.
    pub fn stop(&mut self) {
        self.homing = None;
        for arm in &mut self.arms {
            arm.stop();
        }
    }

    /// Moves the arms. `elapsed_us` is the time since the last call.
    ///
    /// # Errors
    /// The error of one arm. All arms are stopped and must be homed again.
    pub fn poll(&mut self, elapsed_us: u32) -> Result<Motion, ArmError> {
        let mut motion = Motion::Arrived;
        for number in 0..ARMS as u8 {
            let Some(arm) = self.arms.get_mut(usize::from(number)) else {
                break;
            };
            match arm.poll(elapsed_us) {
                Ok(Motion::Arrived) => {}
                Ok(Motion::Moving) => motion = Motion::Moving,
                Err(error) => {
                    self.stop();
                    return Err(ArmError { arm: number, error });
                }
            }
        }
        if let (Motion::Arrived, Some((order, index))) = (motion, self.homing) {
            let next = index.saturating_add(1);
            if next < ARMS {
                self.homing = Some((order, next));
                self.send_home(order, next)?;
                motion = Motion::Moving;
            } else {
                self.homing = None;
            }
        }
        Ok(motion)
    }
}

fn at_arm(arm: u8) -> impl Fn(AxisError) -> ArmError {
    move |error| ArmError { arm, error }
}
