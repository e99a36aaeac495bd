//! One axis: a stepper driver's step and direction pins, and a normally closed switch at one end of the travel.
//!
//! An axis never waits. [`Axis::poll`] takes the elapsed time and makes at most one edge on the step pin. A late caller
//! makes an axis slower, but loses no steps.
//!
//! Every motion toward the switch is bounded: by the travel of the axis if its position is unknown, else by its
//! distance and a tenth of the travel. The switch is read before each step. After an error the axis does not move
//! until [`Axis::home`] is called.

mod settings;
mod switch;

pub use settings::Settings;

use embedded_hal::digital::{InputPin, OutputPin};
use glimpse_core::error::{Error, ErrorCode};

use switch::Switch;

/// Minimum time for which the step pin stays high, µs. Common drivers need 2 µs.
const MIN_PULSE_US: u32 = 2;

/// Part of the travel, a hundredth, within which the switch opens and closes at different positions.
const HYSTERESIS: i32 = 100;
/// Part of the travel, a twentieth, within which a switch must close when the axis leaves it.
const RELEASE: i32 = 20;

/// Task of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Task {
    Idle,
    /// Move from one position to another.
    Move(i32, i32),
    /// Leave the switch slowly, with this number of steps left.
    Release(i32),
    /// Approach the switch slowly, with this number of steps left.
    Approach(i32),
}

/// Returns a function that adds the number of an axis to its error.
pub(crate) fn of_axis(number: u32) -> impl Fn(Error) -> Error {
    move |error| Error {
        details: [number, error.details[1]],
        ..error
    }
}

/// An axis with its pins.
#[derive(Debug)]
pub struct Axis<S, D, H> {
    step: S,
    direction: D,
    switch: Switch<H>,
    pub(crate) settings: Settings,
    task: Task,
    /// Position in steps, as counted; 0 is the angle 0.
    position: i32,
    homed: bool,
    /// Error of the step count when the switch opened last, steps. None if the count was unknown before.
    count_error: Option<i32>,
    is_step_high: bool,
    /// State of the direction pin.
    upwards: Option<bool>,
    since_step_us: u32,
    /// Time from the last step to the next one, µs.
    interval_us: u32,
}

impl<S: OutputPin, D: OutputPin, H: InputPin> Axis<S, D, H> {
    /// Creates an axis at an unknown position. The switch pulls its pin low while it is closed; the arm opens it. A
    /// [`Goniometer`](crate::goniometer::Goniometer) validates the settings, and moves the axis.
    pub fn new(step: S, direction: D, switch: H, settings: Settings) -> Self {
        Self {
            step,
            direction,
            switch: Switch::new(switch),
            settings,
            task: Task::Idle,
            position: 0,
            homed: false,
            count_error: None,
            is_step_high: false,
            upwards: None,
            since_step_us: 0,
            interval_us: 0,
        }
    }

    /// Returns the angle according to the step count, radians. None if the position is unknown.
    pub fn angle(&self) -> Option<f32> {
        self.homed.then(|| self.settings.angle(self.position))
    }

    /// Returns the lost steps: the error of the step count at the last homing, or 0 within the tolerance. None if the
    /// count was unknown before.
    pub fn lost_steps(&self) -> Option<i32> {
        let is_lost = |error: i32| error.saturating_abs() > self.settings.tolerance;
        Some(self.count_error?).map(|error| if is_lost(error) { error } else { 0 })
    }

    /// Assumes an angle from before a reset, if the axis has such a position.
    pub(crate) fn assume(&mut self, angle: f32) {
        self.position = self.settings.steps(angle);
        let distance = self.settings.distance(self.position);
        self.homed = angle.is_finite() && (0..=self.settings.travel()).contains(&distance);
    }

    /// Sends the axis to an angle in radians; [`Axis::poll`] moves it. Beyond its limits it may only stay at its
    /// position.
    ///
    /// # Errors
    /// If the axis is moving or not homed, or the angle is NaN or out of reach.
    pub fn go_to(&mut self, angle: f32) -> Result<(), Error> {
        let mut to = self.settings.steps(angle);
        if angle.is_nan() || to != self.position {
            to = self.settings.steps(self.settings.reach(angle)?);
        }
        match self.homed {
            true => self.begin(Task::Move(self.position, to)),
            false => Err(Error::new(ErrorCode::NotHomed)),
        }
    }

    /// Sends the axis onto its home switch, slowly; [`Axis::poll`] moves it. Afterwards [`Axis::lost_steps`] returns
    /// the lost steps.
    ///
    /// # Errors
    /// If the axis is moving.
    pub fn home(&mut self) -> Result<(), Error> {
        // If the switch is open, the axis first leaves it.
        self.begin(Task::Release(self.settings.margin(RELEASE)))?;
        self.count_error = None;
        Ok(())
    }

    fn begin(&mut self, task: Task) -> Result<(), Error> {
        if self.task != Task::Idle {
            return Err(Error::new(ErrorCode::Moving));
        }
        self.task = task;
        self.interval_us = 0;
        self.switch.restart();
        Ok(())
    }

    /// Stops the axis at once. Its position is unknown afterwards.
    pub fn stop(&mut self) {
        (self.task, self.homed) = (Task::Idle, false);
    }

    /// Moves the axis. `elapsed_us` is the time since the last call. Returns true while the axis is moving.
    ///
    /// # Errors
    /// The error of the axis. It is stopped and must be homed again.
    pub fn poll(&mut self, elapsed_us: u32) -> Result<bool, Error> {
        self.advance(elapsed_us).inspect_err(|_| self.stop())
    }

    fn advance(&mut self, elapsed_us: u32) -> Result<bool, Error> {
        self.since_step_us = self.since_step_us.saturating_add(elapsed_us);
        let is_open = match self.task {
            Task::Idle => None,
            _ => self.switch.poll(elapsed_us)?,
        };
        if self.is_step_high {
            if self.since_step_us >= MIN_PULSE_US {
                self.step
                    .set_low()
                    .map_err(|_| Error::new(ErrorCode::Pin))?;
                self.is_step_high = false;
            }
            return Ok(true);
        }
        if self.since_step_us >= self.interval_us
            && let Some(upwards) = self.next_step(is_open)?
        {
            self.step(upwards)?;
        }
        Ok(self.task != Task::Idle)
    }

    /// Returns the direction of the next step, and sets its time in `interval_us`. None if the task is complete, has
    /// changed to its next phase, or waits for a bouncing contact.
    fn next_step(&mut self, is_open: Option<bool>) -> Result<Option<bool>, Error> {
        let settings = &self.settings;
        let away = settings.is_home_low();
        let distance = settings.distance(self.position);
        match (self.task, is_open) {
            (Task::Idle, _) | (Task::Release(_) | Task::Approach(_), None) => return Ok(None),
            // The contact must be stable before the first step.
            (Task::Move(from, _), None) if self.position == from => return Ok(None),
            (Task::Move(from, to), _) => {
                if is_open == Some(true) && distance > settings.margin(HYSTERESIS) {
                    let details = [0, distance.cast_unsigned()];
                    return Err(Error::with(ErrorCode::SwitchOpened, details));
                }
                return Ok(self.next_ramp_step(from, to));
            }
            (Task::Release(0), Some(true)) => return Err(Error::new(ErrorCode::SwitchStuck)),
            (Task::Release(steps), Some(true)) => self.task = Task::Release(steps - 1),
            (Task::Release(steps), Some(false)) => {
                let released = settings.margin(RELEASE) - steps;
                self.task = Task::Approach(match (released, self.homed) {
                    (0, true) => distance.max(0) + settings.margin(Settings::LOST),
                    (0, false) => settings.travel() + settings.margin(HYSTERESIS),
                    _ => released + settings.margin(HYSTERESIS),
                });
                return Ok(None);
            }
            (Task::Approach(0), Some(false)) => return Err(Error::new(ErrorCode::SwitchNotFound)),
            (Task::Approach(steps), Some(false)) => self.task = Task::Approach(steps - 1),
            (Task::Approach(_), Some(true)) => {
                let home = settings.steps(settings.home);
                self.count_error = self.homed.then_some(self.position - home);
                (self.position, self.homed, self.task) = (home, true, Task::Idle);
                return Ok(None);
            }
        }
        self.interval_us = (1e6 / settings.homing_speed) as u32; // saturates
        Ok(Some(matches!(self.task, Task::Release(_)) == away))
    }

    /// Returns the next step of a trapezoidal speed profile: `k` steps from standstill the speed is that of constant
    /// acceleration.
    fn next_ramp_step(&mut self, from: i32, to: i32) -> Option<bool> {
        let steps_left = to - self.position;
        if steps_left == 0 {
            self.task = Task::Idle;
            return None;
        }
        let done = self.position.abs_diff(from);
        let k = done.min(steps_left.unsigned_abs().saturating_sub(1)) as f32;
        let ramp = libm::sqrtf(self.settings.acceleration * (2.0 * k + 1.0));
        self.interval_us = (1e6 / ramp.min(self.settings.speed)) as u32;
        Some(steps_left > 0)
    }

    /// Raises the step pin. If the direction changes, only sets the direction pin: the step follows in the next poll.
    fn step(&mut self, upwards: bool) -> Result<(), Error> {
        if self.upwards != Some(upwards) {
            let level = upwards != self.settings.reversed;
            let set = self.direction.set_state(level.into());
            set.map_err(|_| Error::new(ErrorCode::Pin))?;
            self.upwards = Some(upwards);
            return Ok(());
        }
        self.step
            .set_high()
            .map_err(|_| Error::new(ErrorCode::Pin))?;
        self.is_step_high = true;
        self.since_step_us = 0;
        self.position += if upwards { 1 } else { -1 };
        Ok(())
    }
}
