//! One arm: a stepper driver's step and direction pins, and a normally closed switch at one end of
//! the travel.
//!
//! An axis never waits. [`Axis::poll`] takes the time that has passed and makes at most one edge on
//! the step pin, so a caller that is late makes an arm slower and never makes it skip.
//!
//! Every motion toward the switch is bounded: by the axis' travel if its position is unknown, else
//! by its distance and a tenth of the travel. The switch is read before each step.

mod error;
mod settings;
mod switch;

pub use error::AxisError;
pub use settings::Settings;

use embedded_hal::digital::{InputPin, OutputPin};

use switch::Switch;

/// Microseconds for which the step pin stays high at least. Every common driver takes 2.
const PULSE_MICROSECONDS: u32 = 2;

/// Whether an arm has arrived.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Motion {
    /// Not yet: go on polling.
    Moving,
    /// It stands where it was sent.
    Arrived,
}

/// The motion of an arm.
#[derive(Clone, Copy, Debug)]
enum Task {
    Standing,
    /// From one step to another.
    Traveling {
        from: i32,
        to: i32,
    },
    /// Near the switch, fast; it stands where the switch opens.
    Returning {
        from: i32,
        to: i32,
    },
    /// Off the switch, slowly; steps since it began.
    Releasing {
        taken: u32,
    },
    /// Onto the switch, slowly; steps that are left.
    Approaching {
        left: u32,
    },
}

/// An arm.
#[derive(Debug)]
pub struct Axis<S, D, H> {
    step: S,
    direction: D,
    switch: Switch<H>,
    settings: Settings,
    task: Task,
    /// Where it is by count of its steps; 0 is the angle 0.
    position: i32,
    homed: bool,
    /// Steps by which the count was off when the switch opened last.
    slip: i32,
    /// The step pin is high.
    pulse: bool,
    /// The direction pin's state.
    upwards: Option<bool>,
    /// Microseconds since the last step.
    since: u32,
    /// Microseconds from the last step to the next one.
    interval: u32,
}

impl<S: OutputPin, D: OutputPin, H: InputPin> Axis<S, D, H> {
    /// An arm at an unknown position. The switch pulls its pin low while it is closed; the arm opens
    /// it.
    pub fn new(step: S, direction: D, switch: H, settings: Settings) -> Self {
        Self {
            step,
            direction,
            switch: Switch::new(switch),
            settings,
            task: Task::Standing,
            position: 0,
            homed: false,
            slip: 0,
            pulse: false,
            upwards: None,
            since: 0,
            interval: 0,
        }
    }

    /// The position by count of its steps.
    pub fn position(&self) -> i32 {
        self.position
    }

    /// Returns true if the position is known.
    pub fn is_homed(&self) -> bool {
        self.homed
    }

    /// The angle by count of its steps, radians.
    pub fn angle(&self) -> f32 {
        self.settings.angle(self.position)
    }

    /// The settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Steps by which the count was off when the arm came home the last time: the lost steps. None
    /// if they are within the tolerance.
    pub fn slip(&self) -> Option<i32> {
        (self.slip.unsigned_abs() > self.settings.tolerance).then_some(self.slip)
    }

    /// Assumes a count from before a reset. The next visit home checks it.
    pub fn assume(&mut self, position: i32) {
        self.position = position;
        self.homed = true;
    }

    /// Checks that a sample's angle, radians, is within the limits.
    ///
    /// # Errors
    /// [`AxisError::OutOfReach`].
    pub fn check(&self, angle: f32) -> Result<(), AxisError> {
        if (self.settings.least..=self.settings.largest).contains(&angle) {
            Ok(())
        } else {
            Err(AxisError::OutOfReach { angle })
        }
    }

    /// Checks that the arm may go to an angle in radians. Outside of the limits it may only stay
    /// where it is, or go to [`Settings::near_home`].
    ///
    /// # Errors
    /// If it is not homed, or cannot reach the angle.
    #[inline(never)] // smaller: loops over the arms are unrolled
    pub fn can_go_to(&self, angle: f32) -> Result<(), AxisError> {
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
    /// If it moves, or may not go there; see [`Axis::can_go_to`].
    pub fn go_to(&mut self, angle: f32) -> Result<(), AxisError> {
        self.can_go_to(angle)?;
        let (from, to) = (self.position, self.settings.steps(angle));
        self.begin(match to == self.settings.near_home_steps() {
            true => Task::Returning { from, to },
            false => Task::Traveling { from, to },
        })
    }

    /// Sends the arm onto its home switch, slowly; [`Axis::poll`] moves it. Afterwards
    /// [`Axis::slip`] returns the lost steps.
    ///
    /// # Errors
    /// If it moves.
    pub fn go_home(&mut self) -> Result<(), AxisError> {
        // Off the switch if it is open, and onto it.
        self.begin(Task::Releasing { taken: 0 })?;
        self.slip = 0;
        Ok(())
    }

    #[inline(never)] // smaller: loops over the arms are unrolled
    fn begin(&mut self, task: Task) -> Result<(), AxisError> {
        if !matches!(self.task, Task::Standing) {
            return Err(AxisError::Moving);
        }
        self.task = task;
        self.interval = 0;
        self.switch.restart();
        Ok(())
    }

    /// Stops the arm where it is. Its position is unknown afterwards.
    #[inline(never)] // smaller: loops over the arms are unrolled
    pub fn stop(&mut self) {
        self.task = Task::Standing;
        self.homed = false;
    }

    /// Moves the arm, `elapsed` microseconds after the last call.
    ///
    /// # Errors
    /// The arm's error; it stands then, and has to be sent home.
    pub fn poll(&mut self, elapsed: u32) -> Result<Motion, AxisError> {
        let motion = self.advance(elapsed);
        if motion.is_err() {
            self.stop();
        }
        motion
    }

    #[inline(never)] // smaller: loops over the arms are unrolled
    fn advance(&mut self, elapsed: u32) -> Result<Motion, AxisError> {
        self.since = self.since.saturating_add(elapsed);
        let is_open = match self.task {
            Task::Standing => None,
            _ => self.switch.poll(elapsed)?,
        };
        if self.pulse {
            if self.since >= PULSE_MICROSECONDS {
                self.step.set_low().map_err(|_| AxisError::Pin)?;
                self.pulse = false;
            }
            return Ok(Motion::Moving);
        }
        if matches!(self.task, Task::Standing) {
            return Ok(Motion::Arrived);
        }
        if self.since >= self.interval {
            match self.next(is_open)? {
                Some(upwards) => self.step(upwards)?,
                None if matches!(self.task, Task::Standing) => return Ok(Motion::Arrived),
                None => {}
            }
        }
        Ok(Motion::Moving)
    }

    /// Returns the direction of the next step, and sets its time in `interval`. None if the task is
    /// done, was changed for the next one, or waits for a contact that bounces.
    fn next(&mut self, is_open: Option<bool>) -> Result<Option<bool>, AxisError> {
        let away = self.settings.is_home_low();
        match self.task {
            Task::Standing => Ok(None),
            Task::Traveling { from, .. } | Task::Returning { from, .. }
                if is_open.is_none() && self.position == from =>
            {
                Ok(None)
            }
            Task::Traveling { from, to } => {
                let steps = self.settings.distance(self.position);
                // On the way out it closes later than it opened on the way home.
                let still_open = match (to > self.position) == away {
                    true => self.settings.clearance(),
                    false => self.settings.tolerance as i32,
                };
                if is_open == Some(true) && steps > still_open {
                    return Err(AxisError::SwitchOpened { steps });
                }
                Ok(self.next_of_ramp(from, to))
            }
            Task::Returning { from, to } => {
                if is_open == Some(true) {
                    // Sooner than it should: the slip is taken where it opens slowly.
                    self.task = Task::Standing;
                    return Ok(None);
                }
                Ok(self.next_of_ramp(from, to))
            }
            Task::Releasing { taken } => match is_open {
                None => Ok(None),
                Some(false) => {
                    let left = self.max_approach(taken);
                    self.task = Task::Approaching { left };
                    Ok(None)
                }
                Some(true) if taken >= self.settings.max_release() => Err(AxisError::HomeStuck),
                Some(true) => {
                    let taken = taken.saturating_add(1);
                    self.task = Task::Releasing { taken };
                    self.interval = interval(self.settings.homing_speed);
                    Ok(Some(away))
                }
            },
            Task::Approaching { left } => match is_open {
                None => Ok(None),
                Some(true) => {
                    let home = self.settings.steps(self.settings.home);
                    if self.homed {
                        self.slip = self.position.saturating_sub(home);
                    }
                    self.position = home;
                    self.homed = true;
                    self.task = Task::Standing;
                    Ok(None)
                }
                Some(false) => {
                    let left = left.checked_sub(1).ok_or(AxisError::HomeNotFound)?;
                    self.task = Task::Approaching { left };
                    self.interval = interval(self.settings.homing_speed);
                    Ok(Some(!away))
                }
            },
        }
    }

    /// Steps within which the switch has to open, `released` steps after the arm was on it.
    fn max_approach(&self, released: u32) -> u32 {
        let distance = self.settings.distance(self.position).max(0).unsigned_abs();
        let clearance = self.settings.clearance().unsigned_abs();
        match (released, self.homed) {
            (0, true) => distance.saturating_add(self.settings.max_slip()),
            (0, false) => self.settings.travel().saturating_add(clearance),
            _ => released.saturating_add(clearance),
        }
    }

    /// A trapezoid: `k` steps from standing still the speed is that of constant acceleration.
    fn next_of_ramp(&mut self, from: i32, to: i32) -> Option<bool> {
        let left = to.saturating_sub(self.position);
        if left == 0 {
            self.task = Task::Standing;
            return None;
        }
        let done = self.position.saturating_sub(from).unsigned_abs();
        let k = done.min(left.unsigned_abs().saturating_sub(1)) as f32;
        let ramp = libm::sqrtf(self.settings.acceleration * (2.0 * k + 1.0));
        self.interval = interval(ramp.min(self.settings.speed));
        Some(left > 0)
    }

    /// Raises the step pin; or turns the direction pin, and the step comes with the next poll.
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
        self.pulse = true;
        self.since = 0;
        self.position = self.position.saturating_add(if upwards { 1 } else { -1 });
        Ok(())
    }
}

/// Microseconds from one step to the next, at a speed in steps/s.
fn interval(speed: f32) -> u32 {
    (1e6 / speed) as u32 // of a speed that makes no sense: as large or as small as it gets
}
