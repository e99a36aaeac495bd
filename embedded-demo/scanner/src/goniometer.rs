//! A goniometer: four axes that move at the same time along safe [routes](crate::route), and are homed one after the
//! other. It never waits: poll it. After an error or a stop nothing moves until [`Goniometer::home`] is called.
//!
//! A stop keeps the positions, and an error those of the other axes. If all are known, homing follows a safe route, and
//! verifies the step counts. Otherwise the sensor's polar axis goes to the horizon first, then the lamp's to the normal,
//! then the azimuths home. Lamp and sensor stay apart if the lamp is nearer to the normal than the sensor:
//! [`Goniometer::needs_confirmation`].
//!
//! At first the directions of the motors are unproven. Each axis has to be within 5 degrees of its switch then, and fails
//! otherwise, with [`ErrorCode::Direction`]: turn the arm onto its switch by hand, with the power off. A firmware keeps
//! [`Goniometer::directions_checked`] in its flash, with [`Goniometer::settings_checksum`], and later calls
//! [`Goniometer::trust_directions`], so that the arms may start anywhere.

use core::f32::consts::PI;

use embedded_hal::digital::{InputPin, OutputPin};
use glimpse_core::checksum::crc_32;
use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::gonio::Limits;

use crate::axis::{Axis, Task, of_axis};
use crate::route::{AxisAngles, FAR_ORDER, HOMING_ORDER, Route, Space, separation_between};

/// Result of a homing: evidence about the readings since the previous homing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepCheck {
    /// No axis has lost steps.
    Passed,
    /// The positions before the homing were unknown.
    Unknown,
    /// An axis has lost steps: its number, and the steps by which its count is ahead of its position.
    Lost(u8, i32),
}

impl StepCheck {
    /// Checks that no axis has lost steps.
    ///
    /// # Errors
    /// [`ErrorCode::LostSteps`], and [`ErrorCode::NotHomed`] if the positions were unknown.
    pub fn passed(self) -> Result<(), Error> {
        match self {
            Self::Passed => Ok(()),
            Self::Unknown => Err(Error::new(ErrorCode::NotHomed)),
            Self::Lost(axis, steps) => {
                let details = [axis.into(), steps.cast_unsigned()];
                Err(Error::with(ErrorCode::LostSteps, details))
            }
        }
    }
}

/// State of a goniometer after a poll.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// An axis is moving.
    Moving,
    /// All axes are at rest: at the target of [`Goniometer::go_to`], unless it was stopped.
    Resting,
    /// All axes are now home. Returned once for each homing.
    Homed(StepCheck),
}

/// Four axes: theta_i, phi_i, theta_o, phi_o.
#[derive(Debug)]
pub struct Goniometer<S, H> {
    axes: [Axis<S, H>; 4],
    space: Space,
    /// The remaining waypoints.
    route: Option<Route>,
    /// The axes to home after the route.
    homing: Option<core::array::IntoIter<usize, 4>>,
    /// The axis that leaves for its far switch at the end of the route.
    far: Option<usize>,
    is_homed: bool,
}

impl<S: OutputPin, H: InputPin> Goniometer<S, H> {
    /// Creates a goniometer that must be homed before it moves. `min_separation` is the minimum angle between lamp and
    /// sensor, radians.
    ///
    /// # Errors
    /// As [`Space::new`].
    pub fn new(axes: [Axis<S, H>; 4], min_separation: f32) -> Result<Self, Error> {
        let settings = axes.each_ref().map(|axis| axis.settings);
        Ok(Self {
            axes,
            space: Space::new(settings, min_separation)?,
            route: None,
            homing: None,
            far: None,
            is_homed: false,
        })
    }

    /// Returns the limits of reachable samples.
    pub fn limits(&self) -> Limits {
        self.space.limits
    }

    /// Returns a checksum of all settings. Directions and angles of other settings are invalid.
    pub fn settings_checksum(&self) -> u32 {
        let settings = (self.space.settings, self.space.limits.min_separation);
        let mut buffer = [0; 256]; // larger than the settings
        postcard::to_slice(&settings, &mut buffer).map_or(0, |bytes| crc_32(bytes))
    }

    /// Returns true if every axis has found its switch, and thus turns in the right direction.
    pub fn directions_checked(&self) -> bool {
        self.axes.iter().all(|axis| axis.is_proven)
    }

    /// Trusts the directions of all motors: they were checked before a reset, with the same settings.
    pub fn trust_directions(&mut self) {
        self.axes.iter_mut().for_each(|axis| axis.is_proven = true);
    }

    /// Assumes the angles from before a reset, with the same settings: homing then follows a safe route, and checks for
    /// steps lost before the reset. Ignores angles out of reach, and all angles before [`Self::trust_directions`] and
    /// while an axis is moving.
    pub fn assume(&mut self, angles: AxisAngles) {
        let mut pairs = self.axes.iter().zip(angles);
        let is_valid = pairs.all(|(axis, angle)| axis.is_proven && axis.is_position(angle));
        if is_valid && self.check_rest().is_ok() {
            for (axis, angle) in self.axes.iter_mut().zip(angles) {
                axis.assume(angle);
            }
        }
    }

    /// Returns the angles according to the step counts, radians. None while one of them is unknown.
    pub fn angles(&self) -> Option<AxisAngles> {
        let angles = self.axes.each_ref().map(Axis::angle);
        let is_known = angles.iter().all(Option::is_some);
        is_known.then(|| angles.map(Option::unwrap_or_default))
    }

    /// Returns true if homing could bring lamp and sensor together: an axis at an unknown position will drive more than 5
    /// degrees. Ask the operator to make sure that the lamp is nearer to the normal than the sensor.
    pub fn needs_confirmation(&self) -> bool {
        let is_unknown = |axis: &Axis<S, H>| axis.is_proven && axis.angle().is_none();
        let [theta_i, _, theta_o, _] = self.axes.each_ref().map(Axis::angle);
        let is_apart = theta_i.zip(theta_o).is_some_and(|(theta_i, theta_o)| {
            let [.., home, _] = self.space.home();
            let (from, to) = ([theta_i, -PI, theta_o, 0.0], [theta_i, PI, home, 0.0]);
            separation_between(from, to) >= self.space.limits.min_separation
        });
        self.axes.iter().any(is_unknown) && !is_apart
    }

    /// Sends the axes home: along a safe route if their positions are known, else first the sensor's polar axis, then
    /// the lamp's, then the azimuths.
    ///
    /// # Errors
    /// If an axis is moving, or no route is safe. No axis moves then.
    pub fn home(&mut self) -> Result<(), Error> {
        self.check_rest()?;
        if let Some(from) = self.angles() {
            self.route = Some(self.space.route(from, self.space.home())?);
        }
        self.is_homed = false;
        self.homing = Some(HOMING_ORDER.into_iter());
        Ok(())
    }

    /// Sends the axes to angles in radians along a safe route. Each may differ by full turns.
    ///
    /// # Errors
    /// If an axis is moving or not homed, an angle is NaN or out of reach, or no route is safe. No axis moves then.
    pub fn go_to(&mut self, angles: AxisAngles) -> Result<(), Error> {
        self.check_rest()?;
        let from = self.angles().filter(|_| self.is_homed);
        let from = from.ok_or(Error::new(ErrorCode::NotHomed))?;
        let mut to = angles;
        for ((number, axis), angle) in (0..).zip(&self.axes).zip(&mut to) {
            *angle = axis.settings.reach(*angle).map_err(of_axis(number))?;
        }
        self.route = Some(self.space.route(from, to)?);
        Ok(())
    }

    fn check_rest(&self) -> Result<(), Error> {
        let is_at_rest = self.route.is_none() && self.homing.is_none();
        let error = Error::new(ErrorCode::Moving);
        is_at_rest.then_some(()).ok_or(error)
    }

    /// Stops all axes at once. They keep their positions, but must be homed again.
    pub fn stop(&mut self) {
        (self.route, self.homing, self.far) = (None, None, None);
        self.is_homed = false;
        self.axes.iter_mut().for_each(|axis| axis.begin(Task::Idle));
    }

    /// Moves the axes. `elapsed_us` is the time since the last call.
    ///
    /// # Errors
    /// The error of an axis, whose position is unknown then. All axes are stopped and must be homed again.
    pub fn poll(&mut self, elapsed_us: u32) -> Result<Motion, Error> {
        self.advance(elapsed_us).inspect_err(|_| self.stop())
    }

    fn advance(&mut self, elapsed_us: u32) -> Result<Motion, Error> {
        let mut is_moving = false;
        for (number, axis) in (0..).zip(&mut self.axes) {
            is_moving |= axis.poll(elapsed_us).map_err(of_axis(number))?;
        }
        if is_moving {
            return Ok(Motion::Moving);
        }
        if let Some(waypoint) = self.route.as_mut().and_then(Iterator::next) {
            for ((number, axis), angle) in (0..).zip(&mut self.axes).zip(waypoint) {
                axis.go_to(angle).map_err(of_axis(number))?;
            }
            return Ok(Motion::Moving);
        }
        self.route = None;
        let Some(homing) = &mut self.homing else {
            return Ok(Motion::Resting);
        };
        if let Some(axis) = homing.next().and_then(|number| self.axes.get_mut(number)) {
            axis.begin(Task::Release);
            return Ok(Motion::Moving);
        }
        let mut order = FAR_ORDER.into_iter();
        let needs_far = |number: &usize| self.axes.get(*number).is_some_and(Axis::needs_far);
        if let Some(number) = order.find(needs_far) {
            self.approach_far(number)?;
            return Ok(Motion::Moving);
        }
        self.homing = None;
        if self.far.take().is_some() {
            self.home()?;
            return Ok(Motion::Moving);
        }
        self.is_homed = true;
        Ok(Motion::Homed(self.check_steps()))
    }

    /// Sends an axis to the end of its travel, and then to its far switch.
    fn approach_far(&mut self, number: usize) -> Result<(), Error> {
        if self.far.replace(number) == Some(number) {
            let axis = self.axes.get_mut(number);
            axis.into_iter().for_each(|axis| axis.begin(Task::Far));
            return Ok(());
        }
        let from = self.angles().ok_or(Error::new(ErrorCode::NotHomed))?;
        self.route = Some(self.space.route_to_end(from, number)?);
        Ok(())
    }

    fn check_steps(&mut self) -> StepCheck {
        let lost = self.axes.each_mut().map(|axis| axis.lost_steps.replace(0));
        for (number, steps) in (0..).zip(lost) {
            match steps {
                Some(0) => {}
                Some(steps) => return StepCheck::Lost(number, steps),
                None => return StepCheck::Unknown,
            }
        }
        StepCheck::Passed
    }
}
