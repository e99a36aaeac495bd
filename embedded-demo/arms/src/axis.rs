//! One arm: a stepper driver's step and direction pins, and a switch at the low end of the travel.
//!
//! An axis never waits. [`Axis::poll`] is told how much time has passed and makes at most one edge
//! on the step pin, so a caller that is late makes an arm slower and never makes it skip.

mod error;
mod settings;

pub use error::AxisError;
pub use settings::Settings;

use embedded_hal::digital::{InputPin, OutputPin};

/// How long the step pin stays high at least, in microseconds. Every common driver takes 2.
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

/// What an arm is about.
#[derive(Clone, Copy, Debug)]
enum Task {
    Standing,
    /// From one step to another.
    Travelling {
        from: i32,
        to: i32,
    },
    /// Home, fast, as far as the clearance.
    Returning {
        from: i32,
        to: i32,
    },
    /// Off the switch, slowly; steps that are left.
    Releasing {
        left: u32,
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
    home: H,
    settings: Settings,
    task: Task,
    /// Where it is by count of its steps; 0 is the angle 0.
    position: i32,
    homed: bool,
    /// Steps by which the count was off when the switch closed last.
    slip: i32,
    /// The step pin is high.
    pulse: bool,
    /// What the direction pin says.
    upwards: Option<bool>,
    /// Microseconds since the last step.
    since: u32,
    /// Microseconds from the last step to the next one.
    interval: u32,
}

impl<S: OutputPin, D: OutputPin, H: InputPin> Axis<S, D, H> {
    /// An arm that does not know where it is yet. The switch pulls its pin low when it is closed.
    pub fn new(step: S, direction: D, home: H, settings: Settings) -> Self {
        Self {
            step,
            direction,
            home,
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

    /// Where it is by count of its steps.
    pub fn position(&self) -> i32 {
        self.position
    }

    /// Whether it knows where it is.
    pub fn is_homed(&self) -> bool {
        self.homed
    }

    /// Its angle by count of its steps, radians.
    pub fn angle(&self) -> f32 {
        self.settings.angle(self.position)
    }

    /// What it is like.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Steps by which its count was off when it came home the last time: those that it lost. None
    /// if they are within the tolerance.
    pub fn slip(&self) -> Option<i32> {
        (self.slip.unsigned_abs() > self.settings.tolerance).then_some(self.slip)
    }

    /// Takes a count from before a reset for true, so that coming home can tell whether it was.
    pub fn assume(&mut self, position: i32) {
        self.position = position;
        self.homed = true;
    }

    /// Whether it could go to an angle in radians.
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

    /// Sends it to an angle in radians; [`Axis::poll`] moves it.
    ///
    /// # Errors
    /// If it moves, is not homed, or cannot reach it.
    pub fn go_to(&mut self, angle: f32) -> Result<(), AxisError> {
        self.check(angle)?;
        if !self.homed {
            return Err(AxisError::NotHomed);
        }
        let to = self.settings.steps(angle);
        self.begin(Task::Travelling {
            from: self.position,
            to,
        })
    }

    /// Sends it onto its home switch, the last bit slowly; [`Axis::poll`] moves it. Afterwards
    /// [`Axis::slip`] tells what it had lost.
    ///
    /// # Errors
    /// If it moves.
    pub fn go_home(&mut self) -> Result<(), AxisError> {
        let near = self
            .settings
            .steps(self.settings.home)
            .saturating_add(self.settings.clearance());
        self.slip = 0;
        self.begin(if self.homed && self.position > near {
            Task::Returning {
                from: self.position,
                to: near,
            }
        } else {
            // Off the switch if it is closed, and onto it.
            Task::Releasing {
                left: self.settings.whole_way(),
            }
        })
    }

    fn begin(&mut self, task: Task) -> Result<(), AxisError> {
        if !matches!(self.task, Task::Standing) {
            return Err(AxisError::Moving);
        }
        self.task = task;
        self.interval = 0;
        Ok(())
    }

    /// Lets it stand where it is. It does not know any more where that is.
    pub fn stop(&mut self) {
        self.task = Task::Standing;
        self.homed = false;
    }

    /// Moves it, `elapsed` microseconds after the last call.
    ///
    /// # Errors
    /// What is wrong with it; it stands then, and has to be sent home.
    pub fn poll(&mut self, elapsed: u32) -> Result<Motion, AxisError> {
        let motion = self.advance(elapsed);
        if motion.is_err() {
            self.stop();
        }
        motion
    }

    fn advance(&mut self, elapsed: u32) -> Result<Motion, AxisError> {
        self.since = self.since.saturating_add(elapsed);
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
            match self.next()? {
                Some(upwards) => self.step(upwards)?,
                None if matches!(self.task, Task::Standing) => return Ok(Motion::Arrived),
                None => {}
            }
        }
        Ok(Motion::Moving)
    }

    /// Which way the next step goes, and in `interval` what time it has; None if the task is done
    /// or was changed for the next one.
    fn next(&mut self) -> Result<Option<bool>, AxisError> {
        let closed = self.home.is_low().map_err(|_| AxisError::Pin)?;
        let home = self.settings.steps(self.settings.home);
        match self.task {
            Task::Standing => Ok(None),
            Task::Travelling { from, to } => {
                let steps = self.position.saturating_sub(home);
                // On the way up it opens later than it closed on the way down.
                let still_closed = match to > self.position {
                    true => self.settings.clearance(),
                    false => self.settings.tolerance as i32,
                };
                if closed && steps > still_closed {
                    return Err(AxisError::Slipped { steps });
                }
                Ok(self.next_of_ramp(from, to, Task::Standing))
            }
            Task::Returning { from, to } => {
                let left = self.settings.whole_way();
                if closed {
                    // Sooner than it should: the slip is taken where it closes slowly.
                    self.task = Task::Releasing { left };
                    return Ok(None);
                }
                Ok(self.next_of_ramp(from, to, Task::Releasing { left }))
            }
            Task::Releasing { left } => {
                if !closed {
                    self.task = Task::Approaching {
                        left: self.settings.whole_way(),
                    };
                    return Ok(None);
                }
                let left = left.checked_sub(1).ok_or(AxisError::HomeStuck)?;
                self.task = Task::Releasing { left };
                self.interval = interval(self.settings.homing_speed);
                Ok(Some(true))
            }
            Task::Approaching { left } => {
                if closed {
                    if self.homed {
                        self.slip = self.position.saturating_sub(home);
                    }
                    self.position = home;
                    self.homed = true;
                    self.task = Task::Standing;
                    return Ok(None);
                }
                let left = left.checked_sub(1).ok_or(AxisError::HomeNotFound)?;
                self.task = Task::Approaching { left };
                self.interval = interval(self.settings.homing_speed);
                Ok(Some(false))
            }
        }
    }

    /// A trapezoid: `k` steps from standing still the speed is that of constant acceleration.
    fn next_of_ramp(&mut self, from: i32, to: i32, then: Task) -> Option<bool> {
        let left = to.saturating_sub(self.position);
        if left == 0 {
            self.task = then;
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
