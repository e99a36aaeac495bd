//! A goniometer: four axes that move at the same time along safe [routes](crate::route), and are homed one after the
//! other. It never waits: poll it. After an error nothing moves until [`Goniometer::home`] is called.

use embedded_hal::digital::{InputPin, OutputPin};
use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::gonio::Limits;

use crate::axis::{Axis, of_axis};
use crate::route::{AxisAngles, HOMING_ORDER, Route, Space};

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
pub enum Progress {
    /// An axis is moving.
    Moving,
    /// All axes are at rest.
    Resting,
    /// All axes have reached the target of [`Goniometer::go_to`]. Returned once for each target.
    Arrived,
    /// All axes are now home. Returned once for each homing.
    Homed(StepCheck),
}

/// Four axes: theta_i, phi_i, theta_o, phi_o.
#[derive(Debug)]
pub struct Goniometer<S, D, H> {
    axes: [Axis<S, D, H>; 4],
    space: Space,
    /// The remaining waypoints.
    route: Option<Route>,
    /// The axes to home after the route.
    homing: Option<core::array::IntoIter<usize, 4>>,
    is_homed: bool,
}

impl<S: OutputPin, D: OutputPin, H: InputPin> Goniometer<S, D, H> {
    /// Creates a goniometer that must be homed before it moves. `min_separation` is the minimum angle between lamp and
    /// sensor, radians. `angles` are those that the firmware has kept over a reset: homing then follows a safe route, and
    /// checks for steps lost before the reset.
    ///
    /// # Errors
    /// As [`Space::new`].
    pub fn new(
        mut axes: [Axis<S, D, H>; 4],
        min_separation: f32,
        angles: Option<AxisAngles>,
    ) -> Result<Self, Error> {
        for (axis, angle) in axes.iter_mut().zip(angles.into_iter().flatten()) {
            axis.assume(angle);
        }
        let settings = axes.each_ref().map(|axis| axis.settings);
        Ok(Self {
            axes,
            space: Space::new(settings, min_separation)?,
            route: None,
            homing: None,
            is_homed: false,
        })
    }

    /// Returns the limits of reachable samples.
    pub fn limits(&self) -> Limits {
        self.space.limits
    }

    /// Returns the angles according to the step counts, radians. None while one of them is unknown.
    pub fn angles(&self) -> Option<AxisAngles> {
        let angles = self.axes.each_ref().map(Axis::angle);
        let is_known = angles.iter().all(Option::is_some);
        is_known.then(|| angles.map(Option::unwrap_or_default))
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

    /// Sends the axes to angles in radians along a safe route. Each may differ by a full turn.
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
        is_at_rest
            .then_some(())
            .ok_or(Error::new(ErrorCode::Moving))
    }

    /// Stops all axes at once. They must be homed again.
    pub fn stop(&mut self) {
        (self.route, self.homing, self.is_homed) = (None, None, false);
        self.axes.iter_mut().for_each(Axis::stop);
    }

    /// Moves the axes. `elapsed_us` is the time since the last call.
    ///
    /// # Errors
    /// The error of an axis. All axes are stopped and must be homed again.
    pub fn poll(&mut self, elapsed_us: u32) -> Result<Progress, Error> {
        self.advance(elapsed_us).inspect_err(|_| self.stop())
    }

    fn advance(&mut self, elapsed_us: u32) -> Result<Progress, Error> {
        let mut is_moving = false;
        for (number, axis) in (0..).zip(&mut self.axes) {
            is_moving |= axis.poll(elapsed_us).map_err(of_axis(number))?;
        }
        if is_moving {
            return Ok(Progress::Moving);
        }
        if let Some(waypoint) = self.route.as_mut().and_then(Iterator::next) {
            for ((number, axis), angle) in (0..).zip(&mut self.axes).zip(waypoint) {
                axis.go_to(angle).map_err(of_axis(number))?;
            }
            return Ok(Progress::Moving);
        }
        let arrived = self.route.take().map(|_| Progress::Arrived);
        let Some(homing) = &mut self.homing else {
            return Ok(arrived.unwrap_or(Progress::Resting));
        };
        if let Some(number) = homing.next()
            && let Some(axis) = self.axes.get_mut(number)
        {
            axis.home().map_err(of_axis(number as u32))?;
            return Ok(Progress::Moving);
        }
        (self.homing, self.is_homed) = (None, true);
        Ok(Progress::Homed(self.check_steps()))
    }

    fn check_steps(&self) -> StepCheck {
        for (number, axis) in (0..).zip(&self.axes) {
            match axis.lost_steps() {
                Some(0) => {}
                Some(steps) => return StepCheck::Lost(number, steps),
                None => return StepCheck::Unknown,
            }
        }
        StepCheck::Passed
    }
}
