//! The arms together: they travel at the same time, and find their switches one after the other.
//!
//! A goniometer does not know which angles are safe together; [`crate::route`] does.

use core::fmt;

use embedded_hal::digital::{InputPin, OutputPin};

use crate::axis::{Axis, AxisError, Motion};

/// An error of one arm.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ArmError {
    /// The arm, in the order that [`Goniometer::new`] was given.
    pub arm: u8,
    /// Its error.
    pub error: AxisError,
}

impl fmt::Display for ArmError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "arm {}: {}", self.arm, self.error)
    }
}

impl core::error::Error for ArmError {}

/// Steps that an arm had lost when it came home.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LostSteps {
    /// The arm.
    pub arm: u8,
    /// Steps by which its count was ahead of its position.
    pub steps: i32,
}

/// `ARMS` arms. The scan's are theta_i, phi_i, theta_o, phi_o.
#[derive(Debug)]
pub struct Goniometer<S, D, H, const ARMS: usize> {
    arms: [Axis<S, D, H>; ARMS],
    /// The order in which arms go home, and the place in it of the one that does.
    homing: Option<([usize; ARMS], usize)>,
}

impl<S: OutputPin, D: OutputPin, H: InputPin, const ARMS: usize> Goniometer<S, D, H, ARMS> {
    /// Arms at unknown positions.
    pub fn new(arms: [Axis<S, D, H>; ARMS]) -> Self {
        Self { arms, homing: None }
    }

    /// The arms.
    pub fn arms(&self) -> &[Axis<S, D, H>; ARMS] {
        &self.arms
    }

    /// Their positions by count of their steps; None while one of them is unknown.
    pub fn positions(&self) -> Option<[i32; ARMS]> {
        let homed = self.arms.iter().all(Axis::is_homed);
        homed.then(|| self.arms.each_ref().map(|arm| arm.position()))
    }

    /// Assumes counts from before a reset. The next visit home checks them.
    pub fn assume(&mut self, positions: [i32; ARMS]) {
        for (arm, position) in self.arms.iter_mut().zip(positions) {
            arm.assume(position);
        }
    }

    /// Checks that a sample's angles, radians, are within the limits of each axis.
    ///
    /// # Errors
    /// The first arm whose angle is not.
    pub fn check(&self, angles: [f32; ARMS]) -> Result<(), ArmError> {
        for ((number, arm), angle) in (0..).zip(&self.arms).zip(angles) {
            arm.check(angle).map_err(of(number))?;
        }
        Ok(())
    }

    /// Sends the arms to angles in radians, all at the same time; see [`Axis::go_to`].
    ///
    /// # Errors
    /// If one of them moves, is not homed, or cannot reach its angle; then none of them moves.
    pub fn go_to(&mut self, angles: [f32; ARMS]) -> Result<(), ArmError> {
        for ((number, arm), angle) in (0..).zip(&self.arms).zip(angles) {
            arm.can_go_to(angle).map_err(of(number))?;
        }
        for ((number, arm), angle) in (0..).zip(&mut self.arms).zip(angles) {
            if let Err(error) = arm.go_to(angle) {
                self.stop();
                return Err(ArmError { arm: number, error });
            }
        }
        Ok(())
    }

    /// Sends the arms onto their home switches, one after the other in an order of their numbers.
    ///
    /// # Errors
    /// If an arm moves.
    pub fn go_home(&mut self, order: [usize; ARMS]) -> Result<(), ArmError> {
        self.homing = Some((order, 0));
        self.send_home(order, 0)
    }

    fn send_home(&mut self, order: [usize; ARMS], place: usize) -> Result<(), ArmError> {
        let number = order.get(place).copied().unwrap_or(ARMS);
        match self.arms.get_mut(number) {
            Some(arm) => arm.go_home().map_err(of(number as u8)),
            None => Ok(()),
        }
    }

    /// Steps that the arms had lost when they came home the last time.
    pub fn lost_steps(&self) -> impl Iterator<Item = LostSteps> + '_ {
        let slips = (0..).zip(self.arms.iter().map(Axis::slip));
        slips.filter_map(|(arm, slip)| slip.map(|steps| LostSteps { arm, steps }))
    }

    /// Stops all arms. They have to be sent home then.
    pub fn stop(&mut self) {
        self.homing = None;
        for arm in &mut self.arms {
            arm.stop();
        }
    }

    /// Moves the arms, `elapsed` microseconds after the last call.
    ///
    /// # Errors
    /// The error of one of them; all of them stand then, and have to be sent home.
    pub fn poll(&mut self, elapsed: u32) -> Result<Motion, ArmError> {
        let mut motion = Motion::Arrived;
        for number in 0..ARMS as u8 {
            let Some(arm) = self.arms.get_mut(usize::from(number)) else {
                break;
            };
            match arm.poll(elapsed) {
                Ok(Motion::Arrived) => {}
                Ok(Motion::Moving) => motion = Motion::Moving,
                Err(error) => {
                    self.stop();
                    return Err(ArmError { arm: number, error });
                }
            }
        }
        if let (Motion::Arrived, Some((order, place))) = (motion, self.homing) {
            let next = place.saturating_add(1);
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

fn of(arm: u8) -> impl Fn(AxisError) -> ArmError {
    move |error| ArmError { arm, error }
}
