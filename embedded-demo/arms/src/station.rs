//! The station: arms, lamp and sensor as one machine. It moves to a sample along a safe [`Route`], and reads it. It
//! never waits.

use core::f32::consts::TAU;
use core::fmt;

use embedded_hal::digital::{InputPin, OutputPin};
use glimpse_core::geometry::{ArmAngles, Directions, Spherical};
use glimpse_core::gonio::{Limits, Machine, Move};
use glimpse_core::scan::Reading;

use crate::axis::{self, Axis, Motion};
use crate::goniometer::{ArmError, Goniometer, LostSteps};
use crate::route::{AxisAngles, Route, RouteError, Space};
use crate::sensor::{Photometer, Sensor, SensorError};

/// Number of arms: theta_i, phi_i, theta_o, phi_o.
pub const ARMS: usize = 4;

/// Settings of a station.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Settings {
    /// Speeds and limits of the arms, which also determine the nearest sample.
    pub machine: Machine,
    /// Time until the arms stop vibrating, with the lamp off, us.
    pub arm_settling_us: u32,
    /// Time until the lamp is steady, us.
    pub lamp_settling_us: u32,
}

/// An error of the station.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StationError {
    /// An error of an arm.
    Arm(ArmError),
    /// An error of sensor or lamp.
    Sensor(SensorError),
    /// No safe route. The arms have not moved.
    Route(RouteError),
}

impl fmt::Display for StationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Arm(error) => error.fmt(f),
            Self::Sensor(error) => error.fmt(f),
            Self::Route(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for StationError {}

impl From<ArmError> for StationError {
    fn from(error: ArmError) -> Self {
        Self::Arm(error)
    }
}

impl From<SensorError> for StationError {
    fn from(error: SensorError) -> Self {
        Self::Sensor(error)
    }
}

impl From<RouteError> for StationError {
    fn from(error: RouteError) -> Self {
        Self::Route(error)
    }
}

/// The result of a task of the station.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum TaskResult {
    /// All arms are home. The value is the first loss of steps, if there is one.
    Homed(Option<LostSteps>),
    /// A sample was read.
    Read {
        /// Index of the sample in the recipe's pattern.
        index: u16,
        /// The reading.
        reading: Reading,
    },
    /// The sensor could not be read at a sample.
    ReadFailed {
        /// Index of the sample in the recipe's pattern.
        index: u16,
        /// The error of the sensor.
        error: SensorError,
    },
}

/// The current task of the station.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Task {
    Idle,
    /// Moving near the home switches.
    MovingHome,
    /// Homing, one arm after the other.
    Homing,
    /// Moving to a sample.
    MovingToSample(Sample),
    /// At the sample with the lamp off; time left, us.
    SettlingArms(Sample, u32),
    /// At the sample with the lamp on; time left, us.
    SettlingLamp(Sample, u32),
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Sample {
    index: u16,
    directions: Directions<f32>,
}

/// A station: arms, lamp and sensor.
#[derive(Debug)]
pub struct Station<S, D, H, A, L> {
    arms: Goniometer<S, D, H, ARMS>,
    photometer: Photometer<A, L>,
    settings: Settings,
    task: Task,
    /// The remaining waypoints.
    route: Route,
}

impl<S, D, H, A, L> Station<S, D, H, A, L>
where
    S: OutputPin,
    D: OutputPin,
    H: InputPin,
    A: Sensor,
    L: OutputPin,
{
    /// Creates an idle station. Its arms must be homed first.
    pub fn new(
        arms: Goniometer<S, D, H, ARMS>,
        photometer: Photometer<A, L>,
        settings: Settings,
    ) -> Self {
        Self {
            arms,
            photometer,
            settings,
            task: Task::Idle,
            route: Route::default(),
        }
    }

    /// Returns the arms.
    pub fn arms(&self) -> &Goniometer<S, D, H, ARMS> {
        &self.arms
    }

    /// Returns the limits of reachable samples: those of the machine, and the ends of the polar axes.
    pub fn limits(&self) -> Limits {
        let limits = self.settings.machine.limits;
        let [theta_i, _, theta_o, _] = self.arms.arms().each_ref().map(Axis::settings);
        Limits {
            max_theta_i: limits.max_theta_i.min(theta_i.max_angle),
            max_theta_o: limits.max_theta_o.min(theta_o.max_angle),
            ..limits
        }
    }

    /// Assumes step counts from before a reset. The next homing checks them.
    pub fn assume(&mut self, positions: [i32; ARMS]) {
        self.arms.assume(positions);
    }

    /// Returns true if the station has no task.
    pub fn is_idle(&self) -> bool {
        self.task == Task::Idle
    }

    /// Sends the arms home: along a safe route if their positions are known, else in the order of
    /// [`Space::homing_order`].
    ///
    /// # Errors
    /// If an arm is moving, the home position is not safe, or no safe route exists.
    pub fn go_home(&mut self) -> Result<(), StationError> {
        self.photometer.set_lamp(false)?;
        let space = self.space();
        space.check_home()?;
        self.route = match self.arms.positions() {
            Some(_) => space.route(self.angles(), space.near_home)?,
            None => Route::default(),
        };
        self.task = Task::MovingHome;
        Ok(())
    }

    /// Returns the nearest of these samples. None if none is within reach.
    pub fn nearest(&self, pending: impl Iterator<Item = (u16, Directions<f32>)>) -> Option<Move> {
        let [theta_i, phi_i, theta_o, phi_o] = self.angles();
        let at = |theta, phi| Spherical { theta, phi };
        let from = ArmAngles {
            incoming: at(theta_i, phi_i),
            outgoing: at(theta_o, phi_o),
        };
        self.settings.machine.nearest(pending, &from)
    }

    /// Sends the arms to a sample along a safe route, and reads it.
    ///
    /// # Errors
    /// If an arm is not homed or does not reach the sample, no safe route exists, or the lamp cannot be switched.
    pub fn read(&mut self, to: Move, directions: Directions<f32>) -> Result<(), StationError> {
        self.photometer.set_lamp(false)?;
        let angles = self.axis_angles(to.arms);
        self.arms.check(angles)?;
        self.route = self
            .space()
            .route(self.angles(), self.round_to_steps(angles))?;
        let index = to.index;
        self.task = Task::MovingToSample(Sample { index, directions });
        Ok(())
    }

    /// Stops the arms and drops the task. The arms must be homed again.
    pub fn stop(&mut self) {
        self.arms.stop();
        self.task = Task::Idle;
        self.route = Route::default();
        // The lamp's pin may be the reason for the stop.
        let _ = self.photometer.set_lamp(false);
    }

    /// Returns the angles of the arms according to the step counts, radians.
    fn angles(&self) -> AxisAngles {
        self.arms.arms().each_ref().map(Axis::angle)
    }

    /// Rounds angles to the nearest steps.
    fn round_to_steps(&self, angles: AxisAngles) -> AxisAngles {
        let mut angles = angles.into_iter();
        self.arms.arms().each_ref().map(|arm| {
            let settings = arm.settings();
            settings.angle(settings.steps(angles.next().unwrap_or_default()))
        })
    }

    /// Returns the configuration space of the arms.
    #[inline(never)] // saves flash: one copy for several calls
    fn space(&self) -> Space {
        let settings = self.arms.arms().each_ref().map(Axis::settings);
        let half_step = |settings: &axis::Settings| 0.5 / settings.steps_per_radian;
        Space {
            min_angles: settings.map(|settings| settings.min_angle),
            max_angles: settings.map(|settings| settings.max_angle),
            home: settings.map(|settings| settings.home),
            near_home: settings.map(axis::Settings::near_home),
            limits: self.settings.machine.limits,
            tolerance: Limits::TOLERANCE + settings.into_iter().map(half_step).sum::<f32>(),
        }
    }

    /// Returns the axis angles of arms. Azimuths are turned by full turns until they are within the limits of their
    /// axis, if possible.
    fn axis_angles(&self, at: ArmAngles) -> [f32; ARMS] {
        let angles = [
            at.incoming.theta,
            at.incoming.phi,
            at.outgoing.theta,
            at.outgoing.phi,
        ];
        let [axis_i, phi_i, axis_o, phi_o] = self.arms.arms();
        let [theta_i, i, theta_o, o] = angles;
        let turned = |angle: f32, check: &dyn Fn(f32) -> bool| {
            let turns = [angle, angle - TAU, angle + TAU];
            turns
                .into_iter()
                .find(|angle| check(*angle))
                .unwrap_or(angle)
        };
        // A sample on a limit may be beyond the end of its axis by a rounding error.
        let polar = |angle: f32, max_angle: f32| match angle <= max_angle + Limits::TOLERANCE {
            true => angle.min(max_angle),
            false => angle,
        };
        [
            polar(theta_i, axis_i.settings().max_angle),
            turned(i, &|angle| phi_i.check(angle).is_ok()),
            polar(theta_o, axis_o.settings().max_angle),
            turned(o, &|angle| phi_o.check(angle).is_ok()),
        ]
    }

    /// Advances the task. `elapsed_us` is the time since the last call. Returns the task's result if it is complete.
    ///
    /// # Errors
    /// The error of the station. It is stopped and must be homed again.
    pub fn poll(&mut self, elapsed_us: u32) -> Result<Option<TaskResult>, StationError> {
        let result = self.advance(elapsed_us);
        if result.is_err() {
            self.stop();
        }
        result
    }

    fn advance(&mut self, elapsed_us: u32) -> Result<Option<TaskResult>, StationError> {
        let motion = self.arms.poll(elapsed_us)?;
        match self.task {
            Task::Idle => {}
            Task::MovingHome | Task::Homing | Task::MovingToSample(_)
                if motion == Motion::Moving => {}
            Task::MovingHome => {
                if let Some(angles) = self.route.next() {
                    self.arms.go_to(angles)?;
                } else {
                    self.arms.go_home(self.space().homing_order())?;
                    self.task = Task::Homing;
                }
            }
            Task::Homing => {
                self.task = Task::Idle;
                return Ok(Some(TaskResult::Homed(self.arms.lost_steps().next())));
            }
            Task::MovingToSample(sample) => match self.route.next() {
                Some(angles) => self.arms.go_to(angles)?,
                None => self.task = Task::SettlingArms(sample, self.settings.arm_settling_us),
            },
            Task::SettlingArms(sample, 0) => {
                if let Err(error) = self.photometer.read_dark() {
                    return self.fail_reading(sample, error);
                }
                self.photometer.set_lamp(true)?;
                self.task = Task::SettlingLamp(sample, self.settings.lamp_settling_us);
            }
            Task::SettlingArms(sample, left) => {
                self.task = Task::SettlingArms(sample, left.saturating_sub(elapsed_us));
            }
            Task::SettlingLamp(sample, 0) => {
                let reading = match self.photometer.read_lit(&sample.directions) {
                    Ok(reading) => reading,
                    Err(error) => return self.fail_reading(sample, error),
                };
                self.photometer.set_lamp(false)?;
                self.task = Task::Idle;
                let index = sample.index;
                return Ok(Some(TaskResult::Read { index, reading }));
            }
            Task::SettlingLamp(sample, left) => {
                self.task = Task::SettlingLamp(sample, left.saturating_sub(elapsed_us));
            }
        }
        Ok(None)
    }

    /// Ends the reading of a sample. An error of the converter is returned as a result, because a new attempt may
    /// succeed. Other errors are permanent.
    fn fail_reading(
        &mut self,
        sample: Sample,
        error: SensorError,
    ) -> Result<Option<TaskResult>, StationError> {
        if error != SensorError::Converter {
            return Err(error.into());
        }
        self.photometer.set_lamp(false)?;
        self.task = Task::Idle;
        let index = sample.index;
        Ok(Some(TaskResult::ReadFailed { index, error }))
    }
}
