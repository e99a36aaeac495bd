//! One axis: a stepper driver's step and direction pins, and a normally closed switch at one end of the travel.
//!
//! An axis never waits. A poll takes the elapsed time and makes at most one edge on the step pin. A late caller makes an
//! axis slower, but loses no steps. The switch is read before each step.
//!
//! Every motion toward the switch is bounded: from a known position by its distance and a tenth of the travel. In
//! addition, the steps of all homings together, since the switch was last open, do not exceed the travel and a hundredth.
//! Until the axis has found its switch for the first time, they do not exceed 5 degrees.

mod settings;
mod switch;

pub use settings::Settings;

use embedded_hal::digital::{InputPin, OutputPin};
use glimpse_core::error::{Error, ErrorCode};

use switch::Switch;

/// Minimum time for which the step pin stays high, µs. Common drivers need 2 µs.
const MIN_PULSE_US: u32 = 2;
/// Bound of a homing before the direction is proven, radians: 5 degrees.
const JOG: f32 = 0.0873;
/// Tolerance of the far switch's angle, radians: 1 degree.
const FAR_TOLERANCE: f32 = 0.01745;
/// Repeated approaches to the switch after an unknown position.
const RETRIES: u8 = 2;

/// Task of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Task {
    Idle,
    /// Move from one position to another.
    Move(i32, i32),
    /// Leave the home switch slowly, if it is open, and approach it.
    Release,
    /// Approach the switch slowly.
    Approach,
    /// Approach the far switch slowly from the end of the travel, and return to the end.
    Far,
}

/// Returns a function that adds the number of an axis to its error.
pub(crate) fn of_axis(number: u32) -> impl Fn(Error) -> Error {
    move |error| Error {
        details: [number, error.details[1]],
        ..error
    }
}

/// The error of a pin.
const PIN: Error = Error::new(ErrorCode::Pin);

/// Creates an error with steps.
fn with_steps(code: ErrorCode, steps: i32) -> Error {
    Error::with(code, [0, steps.cast_unsigned()])
}

/// An axis with its pins. A [`Goniometer`](crate::goniometer::Goniometer) validates its settings, and moves it.
#[derive(Debug)]
pub struct Axis<S, H> {
    step: S,
    direction: S,
    switch: Switch<H>,
    pub(crate) settings: Settings,
    task: Task,
    /// Position in steps, as counted; 0 is the angle 0.
    position: i32,
    is_known: bool,
    /// True once the axis has found its switch, and thus turns in the right direction.
    pub(crate) is_proven: bool,
    /// True unless the far switch has to be found.
    is_scaled: bool,
    /// Lost steps, or 0 within the tolerance, since the [`Goniometer`](crate::goniometer::Goniometer) has read them. None
    /// if the position was unknown in the meantime.
    pub(crate) lost_steps: Option<i32>,
    /// Steps of homings toward the closed switch since it was open.
    searched: i32,
    /// Steps of homings at the open switch since it was closed.
    released: i32,
    /// Approaches left.
    retries: u8,
    /// Lowest and highest position of the switch's openings after an unknown position, relative to the first.
    openings: (i32, i32),
    is_step_high: bool,
    /// State of the direction pin.
    upwards: Option<bool>,
    since_step_us: u32,
    /// Time from the last step to the next one, µs.
    interval_us: u32,
}

impl<S: OutputPin, H: InputPin> Axis<S, H> {
    /// Creates an axis at an unknown position. The switch pulls its pin low while it is closed; the arm opens it.
    pub fn new(step: S, direction: S, switch: H, settings: Settings) -> Self {
        Self {
            step,
            direction,
            switch: Switch::new(switch),
            settings,
            task: Task::Idle,
            position: 0,
            is_known: false,
            is_proven: false,
            is_scaled: true,
            lost_steps: None,
            searched: 0,
            released: 0,
            retries: 0,
            openings: (0, 0),
            is_step_high: false,
            upwards: None,
            since_step_us: 0,
            interval_us: 0,
        }
    }

    /// Returns the angle according to the step count, radians. None if the position is unknown.
    pub(crate) fn angle(&self) -> Option<f32> {
        self.is_known.then(|| self.settings.angle(self.position))
    }

    /// Returns true if the axis could have this angle.
    pub(crate) fn is_position(&self, angle: f32) -> bool {
        let settings = &self.settings;
        let positions = -settings.margin(Settings::HYSTERESIS)..=settings.span();
        angle.is_finite() && positions.contains(&settings.distance(settings.steps(angle)))
    }

    /// Assumes an angle from before a reset.
    pub(crate) fn assume(&mut self, angle: f32) {
        self.position = self.settings.steps(angle);
        (self.is_known, self.lost_steps) = (true, Some(0));
    }

    /// Sends the axis from its known position to an angle in radians. Beyond its limits it may only stay.
    ///
    /// # Errors
    /// If the angle is NaN or out of reach.
    pub(crate) fn go_to(&mut self, angle: f32) -> Result<(), Error> {
        let mut to = self.settings.steps(angle);
        if angle.is_nan() || to != self.position {
            to = self.settings.steps(self.settings.reach(angle)?);
        }
        self.begin(Task::Move(self.position, to));
        Ok(())
    }

    /// Returns true if the position was unknown, and the far switch has not been found since.
    pub(crate) fn needs_far(&self) -> bool {
        self.settings.far.is_some() && !self.is_scaled
    }

    /// Begins a task, or stops the axis at once. It keeps its position, which the next homing verifies.
    pub(crate) fn begin(&mut self, task: Task) {
        self.task = task;
        self.interval_us = 0;
        self.switch.restart();
    }

    /// Moves the axis. `elapsed_us` is the time since the last call. Returns true while the axis is moving.
    ///
    /// # Errors
    /// The error of the axis. It is stopped, and its position is unknown.
    pub(crate) fn poll(&mut self, elapsed_us: u32) -> Result<bool, Error> {
        self.advance(elapsed_us).inspect_err(|_| {
            (self.task, self.is_known, self.lost_steps) = (Task::Idle, false, None);
        })
    }

    fn advance(&mut self, elapsed_us: u32) -> Result<bool, Error> {
        self.since_step_us = self.since_step_us.saturating_add(elapsed_us);
        let is_open = match self.task {
            Task::Idle => None,
            _ => self.switch.poll(elapsed_us)?,
        };
        if self.is_step_high {
            if self.since_step_us >= MIN_PULSE_US {
                self.step.set_low().map_err(|_| PIN)?;
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
        if self.task == Task::Idle {
            return Ok(None);
        }
        let settings = self.settings;
        let hysteresis = settings.margin(Settings::HYSTERESIS);
        let distance = settings.distance(self.position);
        let beyond_far = distance - settings.span();
        let jog = settings.steps(if self.is_proven { f32::INFINITY } else { JOG });
        let far_tolerance = self.tolerance().max(settings.steps(FAR_TOLERANCE));
        let is_away = match (self.task, is_open) {
            // The contact must be stable before the first step.
            (Task::Move(from, _), None) if self.position == from => return Ok(None),
            (Task::Move(from, to), _) => {
                let is_at_far = settings.far.is_some() && beyond_far >= -hysteresis - far_tolerance;
                if is_open == Some(true) && distance > hysteresis && !is_at_far {
                    return Err(match self.needs_far() {
                        true => with_steps(ErrorCode::Scale, beyond_far),
                        false => with_steps(ErrorCode::SwitchOpened, distance),
                    });
                }
                return Ok(self.next_ramp_step(from, to));
            }
            (_, None) | (Task::Idle, _) => return Ok(None),
            (Task::Release, Some(true)) => {
                let reach = settings.margin(Settings::RELEASE).min(jog);
                // An axis at its far switch turns back.
                let can_turn = settings.far.is_some() && self.is_proven;
                if self.released >= reach * if can_turn { 4 } else { 1 } {
                    return Err(Error::new(ErrorCode::SwitchStuck));
                }
                (self.searched, self.released) = (0, self.released + 1);
                self.released <= reach
            }
            (Task::Release, Some(false)) => {
                (self.task, self.released) = (Task::Approach, 0);
                return Ok(None);
            }
            (Task::Approach, Some(false)) => {
                let is_lost = self.is_known && distance <= -settings.margin(Settings::LOST);
                if self.searched >= jog.min(settings.span() + hysteresis) || is_lost {
                    return Err(Error::new(match self.is_proven {
                        true => ErrorCode::SwitchNotFound,
                        false => ErrorCode::Direction,
                    }));
                }
                self.searched += 1;
                false
            }
            (Task::Approach, Some(true)) => return self.find_home().map(|()| None),
            (Task::Far, Some(is_open)) => {
                if is_open && beyond_far.abs() <= far_tolerance {
                    self.is_scaled = true;
                    return self.go_to(settings.end()).map(|()| None);
                }
                if is_open || beyond_far >= far_tolerance {
                    return Err(with_steps(ErrorCode::Scale, beyond_far));
                }
                true
            }
        };
        self.interval_us = (1e6 / settings.homing_speed) as u32; // saturates
        Ok(Some(is_away == settings.is_home_low()))
    }

    /// Returns the tolerance of the step count: that of the settings, and the scatter of the switch.
    fn tolerance(&self) -> i32 {
        self.settings.tolerance + self.openings.1 - self.openings.0
    }

    /// Compares the step count with the position of the switch, which has opened. After an unknown position the axis
    /// repeats the approach, to learn the scatter of the switch.
    fn find_home(&mut self) -> Result<(), Error> {
        let home = self.settings.steps(self.settings.home);
        let error = self.position - home;
        (self.searched, self.task) = (0, Task::Idle);
        if !self.is_known {
            (self.is_known, self.is_scaled, self.position) = (true, false, home);
            (self.retries, self.openings) = (RETRIES, (0, 0));
        } else if self.retries > 0 {
            let (low, high) = self.openings;
            self.openings = (low.min(error), high.max(error));
            self.retries -= 1;
            if self.tolerance() > self.settings.margin(Settings::HYSTERESIS) {
                return Err(Error::new(ErrorCode::SwitchBounces));
            }
        } else {
            self.position = home;
            if self.lost_steps == Some(0) && error.saturating_abs() > self.tolerance() {
                self.lost_steps = Some(error);
            }
        }
        match self.retries {
            0 => self.is_proven = true,
            _ => self.task = Task::Release,
        }
        Ok(())
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
            set.map_err(|_| PIN)?;
            self.upwards = Some(upwards);
            return Ok(());
        }
        self.step.set_high().map_err(|_| PIN)?;
        self.is_step_high = true;
        self.since_step_us = 0;
        self.position += if upwards { 1 } else { -1 };
        Ok(())
    }
}
