//! One arm: a stepper driver's step and direction pins, and a normally closed switch at one end of the travel.
//!
//! An axis never waits. [`Axis::poll`] takes the elapsed time and makes at most one edge on the step pin. A late caller
//! makes an arm slower, but loses no steps.
//!
//! Every motion toward the switch is bounded: by the travel of the axis if its position is unknown, else by its
//! distance and a tenth of the travel. The switch is read before each step.

mod error;
mod settings;
mod switch;

pub use error::AxisError;
pub use settings::Settings;

use embedded_hal::digital::{InputPin, OutputPin};

use switch::Switch;

/// Minimum time for which the step pin stays high, us. Common drivers need 2 us.
const MIN_PULSE_US: u32 = 2;

/// State of a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Motion {
    /// The arm is moving: call [`Axis::poll`] again.
    Moving,
    /// The arm is at its target.
    Arrived,
}

/// Task of an arm.
#[derive(Clone, Copy, Debug)]
enum Task {
    Idle,
    /// Move from one position to another.
    Traveling {
        from: i32,
        to: i32,
    },
    /// Move near the switch at full speed. The arm stops if the switch opens.
    Returning {
        from: i32,
        to: i32,
    },
    /// Leave the switch slowly; steps so far.
    Releasing {
        steps: u32,
    },
    /// Approach the switch slowly; steps left.
    Approaching {
        steps_left: u32,
    },
}

/// An arm with its pins.
#[derive(Debug)]
pub struct Axis<S, D, H> {
    step: S,
    direction: D,
    switch: Switch<H>,
    settings: Settings,
    task: Task,
    /// Position in steps, as counted; 0 is the angle 0.
    position: i32,
    homed: bool,
    /// Error of the step count when the switch opened last, steps.
    count_error: i32,
    /// The step pin is high.
    is_step_high: bool,
    /// State of the direction pin.
    upwards: Option<bool>,
    /// Time since the last step, us.
    since_step_us: u32,
    /// Time from the last step to the next one, us.
    interval_us: u32,
}

impl<S: OutputPin, D: OutputPin, H: InputPin> Axis<S, D, H> {
    /// Creates an arm at an unknown position. The switch pulls its pin low while it is closed; the arm opens it.
    pub fn new(step: S, direction: D, switch: H, settings: Settings) -> Self {
        Self {
            step,
            direction,
            switch: Switch::new(switch),
            settings,
            task: Task::Idle,
            position: 0,
            homed: false,
            count_error: 0,
            is_step_high: false,
            upwards: None,
            since_step_us: 0,
            interval_us: 0,
        }
    }

    /// Returns the position according to the step count.
    pub fn position(&self) -> i32 {
        self.position
    }

    /// Returns true if the position is known.
    pub fn is_homed(&self) -> bool {
        self.homed
    }

    /// Returns the angle according to the step count, radians.
    pub fn angle(&self) -> f32 {
        self.settings.angle(self.position)
    }

    /// Returns the settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Returns the lost steps: the error of the step count at the last homing. None within the tolerance.
    pub fn lost_steps(&self) -> Option<i32> {
        (self.count_error.unsigned_abs() > self.settings.tolerance).then_some(self.count_error)
    }

    /// Assumes a step count from before a reset. The next homing checks it.
    pub fn assume(&mut self, position: i32) {
        self.position = position;
        self.homed = true;
    }

    /// Checks that a sample's angle, radians, is within the limits.
    ///
    /// # Errors
    /// [`AxisError::OutOfReach`].
    pub fn check(&self, angle: f32) -> Result<(), AxisError> {
        if (self.settings.min_angle..=self.settings.max_angle).contains(&angle) {
            Ok(())
        } else {
            Err(AxisError::OutOfReach { angle })
        }
    }

    /// Checks that the arm may move to an angle, radians. Beyond its limits it may only stay at its position, or move
    /// to [`Settings::near_home`].
    ///
    /// # Errors
    /// If the arm is not homed, or cannot reach the angle.
    #[inline(never)] // saves flash: one copy, instead of one for each arm in unrolled loops
    pub fn check_move(&self, angle: f32) -> Result<(), AxisError> {
        let to = self.settings.steps(angle);
        if to != self.position && to != self.settings.near_home_steps() {
            self.check(angle)?;
        }
        if self.homed {
            Ok(())
        } else {
            Err(AxisError::NotHomed)
        }
    }

    /// Sends the arm to an angle in radians; [`Axis::poll`] moves it.
    ///
    /// # Errors
    /// If the arm is moving, or may not move there; see [`Axis::check_move`].
    pub fn go_to(&mut self, angle: f32) -> Result<(), AxisError> {
        self.check_move(angle)?;
        let (from, to) = (self.position, self.settings.steps(angle));
        self.begin(match to == self.settings.near_home_steps() {
            true => Task::Returning { from, to },
            false => Task::Traveling { from, to },
        })
    }

    /// Sends the arm onto its home switch, slowly; [`Axis::poll`] moves it. Afterwards [`Axis::lost_steps`] returns the
    /// lost steps.
    ///
    /// # Errors
    /// If the arm is moving.
    pub fn go_home(&mut self) -> Result<(), AxisError> {
        // If the switch is open, the arm first leaves it.
        self.begin(Task::Releasing { steps: 0 })?;
        self.count_error = 0;
        Ok(())
    }

    #[inline(never)] // saves flash: one copy, instead of one for each arm in unrolled loops
    fn begin(&mut self, task: Task) -> Result<(), AxisError> {
        if !matches!(self.task, Task::Idle) {
            return Err(AxisError::Moving);
        }
        self.task = task;
        self.interval_us = 0;
        self.switch.restart();
        Ok(())
    }

    /// Stops the arm at once. Its position is unknown afterwards.
    #[inline(never)] // saves flash: one copy, instead of one for each arm in unrolled loops
    pub fn stop(&mut self) {
        self.task = Task::Idle;
        self.homed = false;
    }

    /// Moves the arm. `elapsed_us` is the time since the last call.
    ///
    /// # Errors
    /// The error of the arm. It is stopped and must be homed again.
    pub fn poll(&mut self, elapsed_us: u32) -> Result<Motion, AxisError> {
        let motion = self.advance(elapsed_us);
        if motion.is_err() {
            self.stop();
        }
        motion
    }

    #[inline(never)] // saves flash: one copy, instead of one for each arm in unrolled loops
    fn advance(&mut self, elapsed_us: u32) -> Result<Motion, AxisError> {
        self.since_step_us = self.since_step_us.saturating_add(elapsed_us);
        let is_open = match self.task {
            Task::Idle => None,
            _ => self.switch.poll(elapsed_us)?,
        };
        if self.is_step_high {
            if self.since_step_us >= MIN_PULSE_US {
                self.step.set_low().map_err(|_| AxisError::Pin)?;
                self.is_step_high = false;
            }
            return Ok(Motion::Moving);
        }
        if matches!(self.task, Task::Idle) {
            return Ok(Motion::Arrived);
        }
        if self.since_step_us >= self.interval_us {
            match self.next_step(is_open)? {
                Some(upwards) => self.step(upwards)?,
                None if matches!(self.task, Task::Idle) => return Ok(Motion::Arrived),
                None => {}
            }
        }
        Ok(Motion::Moving)
    }

    /// Returns the direction of the next step, and sets its time in `interval_us`. None if the task is complete, has
    /// changed to its next phase, or waits for a bouncing contact.
    fn next_step(&mut self, is_open: Option<bool>) -> Result<Option<bool>, AxisError> {
        let away = self.settings.is_home_low();
        match self.task {
            Task::Idle => Ok(None),
            Task::Traveling { from, .. } | Task::Returning { from, .. }
                if is_open.is_none() && self.position == from =>
            {
                Ok(None)
            }
            Task::Traveling { from, to } => {
                let steps = self.settings.distance(self.position);
                // On the way out the switch closes later than it opened on the way home.
                let max_open_distance = match (to > self.position) == away {
                    true => self.settings.clearance(),
                    false => self.settings.tolerance as i32,
                };
                if is_open == Some(true) && steps > max_open_distance {
                    return Err(AxisError::SwitchOpened { steps });
                }
                Ok(self.next_ramp_step(from, to))
            }
            Task::Returning { from, to } => {
                if is_open == Some(true) {
                    // Earlier than expected. The slow approach measures the error of the count.
                    self.task = Task::Idle;
                    return Ok(None);
                }
                Ok(self.next_ramp_step(from, to))
            }
            Task::Releasing { steps } => match is_open {
                None => Ok(None),
                Some(false) => {
                    let steps_left = self.max_approach(steps);
                    self.task = Task::Approaching { steps_left };
                    Ok(None)
                }
                Some(true) if steps >= self.settings.max_release_steps() => {
                    Err(AxisError::HomeStuck)
                }
                Some(true) => {
                    let steps = steps.saturating_add(1);
                    self.task = Task::Releasing { steps };
                    self.interval_us = interval_us(self.settings.homing_speed);
                    Ok(Some(away))
                }
            },
            Task::Approaching { steps_left } => match is_open {
                None => Ok(None),
                Some(true) => {
                    let home = self.settings.steps(self.settings.home);
                    if self.homed {
                        self.count_error = self.position.saturating_sub(home);
                    }
                    self.position = home;
                    self.homed = true;
                    self.task = Task::Idle;
                    Ok(None)
                }
                Some(false) => {
                    let steps_left = steps_left.checked_sub(1).ok_or(AxisError::HomeNotFound)?;
                    self.task = Task::Approaching { steps_left };
                    self.interval_us = interval_us(self.settings.homing_speed);
                    Ok(Some(!away))
                }
            },
        }
    }

    /// Returns the steps within which the switch must open, `released` steps after the arm left it.
    fn max_approach(&self, released: u32) -> u32 {
        let distance = self.settings.distance(self.position).max(0).unsigned_abs();
        let clearance = self.settings.clearance().unsigned_abs();
        match (released, self.homed) {
            (0, true) => distance.saturating_add(self.settings.max_lost_steps()),
            (0, false) => self.settings.travel().saturating_add(clearance),
            _ => released.saturating_add(clearance),
        }
    }

    /// Returns the next step of a trapezoidal speed profile: `k` steps from standstill the speed is that of constant
    /// acceleration.
    fn next_ramp_step(&mut self, from: i32, to: i32) -> Option<bool> {
        let steps_left = to.saturating_sub(self.position);
        if steps_left == 0 {
            self.task = Task::Idle;
            return None;
        }
        let done = self.position.saturating_sub(from).unsigned_abs();
        let k = done.min(steps_left.unsigned_abs().saturating_sub(1)) as f32;
        let ramp = libm::sqrtf(self.settings.acceleration * (2.0 * k + 1.0));
        self.interval_us = interval_us(ramp.min(self.settings.speed));
        Some(steps_left > 0)
    }

    /// Raises the step pin. If the direction changes, only sets the direction pin: the step follows in the next poll.
    fn step(&mut self, upwards: bool) -> Result<(), AxisError> {
        if self.upwards != Some(upwards) {
            let level = upwards != self.settings.reversed;
            self.direction
                .set_state(level.into())
                .map_err(|_| AxisError::Pin)?;
            self.upwards = Some(upwards);
            return Ok(());
        }
        self.step.set_high().map_err(|_| AxisError::Pin)?;
        self.is_step_high = true;
        self.since_step_us = 0;
        self.position = self.position.saturating_add(if upwards { 1 } else { -1 });
        Ok(())
    }
}

/// Returns the time between two steps at a speed in steps/s, us.
fn interval_us(speed: f32) -> u32 {
    (1e6 / speed) as u32 // saturates for invalid speeds
}
