//! Arms, lamp and sensor as one machine: it goes to a sample by a safe [`Route`], and reads. It never
//! waits.

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

/// theta_i, phi_i, theta_o, phi_o.
pub const ARMS: usize = 4;

/// Settings of a station.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Settings {
    /// The arms' speeds and limits, and which samples are near.
    pub machine: Machine,
    /// Microseconds until the arms hang still, the lamp off.
    pub arms_settle: u32,
    /// Microseconds until the lamp is steady.
    pub lamp_settles: u32,
}

/// An error of the machine.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StationError {
    /// An arm's error.
    Arm(ArmError),
    /// An error of sensor or lamp.
    Sensor(SensorError),
    /// No safe way; nothing has moved.
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

/// A task that a station has done.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Done {
    /// All arms are home; the first loss of steps, if an arm had lost any.
    Home(Option<LostSteps>),
    /// A sample was read.
    Read {
        /// Its index in the recipe's pattern.
        index: u16,
        /// Its reading.
        reading: Reading,
    },
    /// The sensor could not be read at a sample.
    Unread {
        /// The index of the sample in the recipe's pattern.
        index: u16,
        /// The sensor's error.
        error: SensorError,
    },
}

/// The present task.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Doing {
    Nothing,
    /// On its way to the home switches.
    GoingHome,
    /// At the home switches, one arm after the other.
    Homing,
    /// On its way to a sample.
    Going(Sample),
    /// There, the lamp off, for so many microseconds.
    Still(Sample, u32),
    /// There, the lamp on, for so many microseconds.
    Lit(Sample, u32),
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Sample {
    index: u16,
    directions: Directions<f32>,
}

/// Arms, lamp and sensor.
#[derive(Debug)]
pub struct Station<S, D, H, A, L> {
    arms: Goniometer<S, D, H, ARMS>,
    photometer: Photometer<A, L>,
    settings: Settings,
    doing: Doing,
    /// The legs of the way that have not begun.
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
    /// A station that does nothing yet; its arms have to be sent home first.
    pub fn new(
        arms: Goniometer<S, D, H, ARMS>,
        photometer: Photometer<A, L>,
        settings: Settings,
    ) -> Self {
        Self {
            arms,
            photometer,
            settings,
            doing: Doing::Nothing,
            route: Route::default(),
        }
    }

    /// The arms.
    pub fn arms(&self) -> &Goniometer<S, D, H, ARMS> {
        &self.arms
    }

    /// Limits of the samples that the arms reach: those of the machine, and the ends of the polar axes.
    pub fn limits(&self) -> Limits {
        let limits = self.settings.machine.limits;
        let [theta_i, _, theta_o, _] = self.arms.arms().each_ref().map(Axis::settings);
        Limits {
            max_theta_i: limits.max_theta_i.min(theta_i.largest),
            max_theta_o: limits.max_theta_o.min(theta_o.largest),
            ..limits
        }
    }

    /// Assumes counts from before a reset. The next visit home checks them.
    pub fn assume(&mut self, positions: [i32; ARMS]) {
        self.arms.assume(positions);
    }

    /// Returns true if it has no task.
    pub fn is_idle(&self) -> bool {
        self.doing == Doing::Nothing
    }

    /// Sends the arms home: by a safe route if their positions are known, else in the order of
    /// [`Space::homing_order`].
    ///
    /// # Errors
    /// If one of them moves, home is not safe, or no safe route is known.
    pub fn go_home(&mut self) -> Result<(), StationError> {
        self.photometer.light(false)?;
        let space = self.space();
        space.check_home()?;
        self.route = match self.arms.positions() {
            Some(_) => space.route(self.angles(), space.near_home)?,
            None => Route::default(),
        };
        self.doing = Doing::GoingHome;
        Ok(())
    }

    /// The nearest of these samples; None if none is within reach.
    pub fn nearest(&self, pending: impl Iterator<Item = (u16, Directions<f32>)>) -> Option<Move> {
        let [theta_i, phi_i, theta_o, phi_o] = self.angles();
        let at = |theta, phi| Spherical { theta, phi };
        let from = ArmAngles {
            incoming: at(theta_i, phi_i),
            outgoing: at(theta_o, phi_o),
        };
        self.settings.machine.nearest(pending, &from)
    }

    /// Sends the arms to a sample by a safe route, to read it.
    ///
    /// # Errors
    /// If an arm is not homed or does not reach the sample, no safe route is known, or the lamp
    /// cannot be switched.
    pub fn read(&mut self, to: Move, directions: Directions<f32>) -> Result<(), StationError> {
        self.photometer.light(false)?;
        let angles = self.within(to.arms);
        self.arms.check(angles)?;
        self.route = self.space().route(self.angles(), self.at_steps(angles))?;
        let index = to.index;
        self.doing = Doing::Going(Sample { index, directions });
        Ok(())
    }

    /// Stops the arms and drops the task. They have to be sent home then.
    pub fn stop(&mut self) {
        self.arms.stop();
        self.doing = Doing::Nothing;
        self.route = Route::default();
        // The lamp's pin may be what failed.
        let _ = self.photometer.light(false);
    }

    /// The arms' angles by count of their steps, radians.
    fn angles(&self) -> AxisAngles {
        self.arms.arms().each_ref().map(Axis::angle)
    }

    /// The angles at the steps that are nearest to these.
    fn at_steps(&self, angles: AxisAngles) -> AxisAngles {
        let mut angles = angles.into_iter();
        self.arms.arms().each_ref().map(|arm| {
            let settings = arm.settings();
            settings.angle(settings.steps(angles.next().unwrap_or_default()))
        })
    }

    /// The configurations that the arms may take.
    #[inline(never)] // smaller: there are several calls of it
    fn space(&self) -> Space {
        let settings = self.arms.arms().each_ref().map(Axis::settings);
        let half_a_step = |settings: &axis::Settings| 0.5 / settings.steps_per_radian;
        Space {
            least: settings.map(|settings| settings.least),
            largest: settings.map(|settings| settings.largest),
            home: settings.map(|settings| settings.home),
            near_home: settings.map(axis::Settings::near_home),
            limits: self.settings.machine.limits,
            tolerance: Limits::TOLERANCE + settings.into_iter().map(half_a_step).sum::<f32>(),
        }
    }

    /// The arms' angles, azimuths turned round until they are between the axes' limits, if they can
    /// be.
    fn within(&self, at: ArmAngles) -> [f32; ARMS] {
        let angles = [
            at.incoming.theta,
            at.incoming.phi,
            at.outgoing.theta,
            at.outgoing.phi,
        ];
        let [axis_i, phi_i, axis_o, phi_o] = self.arms.arms();
        let [theta_i, i, theta_o, o] = angles;
        let turned = |angle: f32, check: &dyn Fn(f32) -> bool| {
            let ways = [angle, angle - TAU, angle + TAU];
            ways.into_iter().find(|way| check(*way)).unwrap_or(angle)
        };
        // A sample on a limit may be a rounding error beyond the end of its axis.
        let polar = |angle: f32, largest: f32| match angle <= largest + Limits::TOLERANCE {
            true => angle.min(largest),
            false => angle,
        };
        [
            polar(theta_i, axis_i.settings().largest),
            turned(i, &|angle| phi_i.check(angle).is_ok()),
            polar(theta_o, axis_o.settings().largest),
            turned(o, &|angle| phi_o.check(angle).is_ok()),
        ]
    }

    /// Goes on, `elapsed` microseconds after the last call. Returns the task if it is done.
    ///
    /// # Errors
    /// The machine's error. It stands then, and has to be sent home.
    pub fn poll(&mut self, elapsed: u32) -> Result<Option<Done>, StationError> {
        let done = self.advance(elapsed);
        if done.is_err() {
            self.stop();
        }
        done
    }

    fn advance(&mut self, elapsed: u32) -> Result<Option<Done>, StationError> {
        let motion = self.arms.poll(elapsed)?;
        match self.doing {
            Doing::Nothing => {}
            Doing::GoingHome | Doing::Homing | Doing::Going(_) if motion == Motion::Moving => {}
            Doing::GoingHome => {
                if let Some(angles) = self.route.next() {
                    self.arms.go_to(angles)?;
                } else {
                    self.arms.go_home(self.space().homing_order())?;
                    self.doing = Doing::Homing;
                }
            }
            Doing::Homing => {
                self.doing = Doing::Nothing;
                return Ok(Some(Done::Home(self.arms.lost_steps().next())));
            }
            Doing::Going(sample) => match self.route.next() {
                Some(angles) => self.arms.go_to(angles)?,
                None => self.doing = Doing::Still(sample, self.settings.arms_settle),
            },
            Doing::Still(sample, 0) => {
                if let Err(error) = self.photometer.read_dark() {
                    return self.unread(sample, error);
                }
                self.photometer.light(true)?;
                self.doing = Doing::Lit(sample, self.settings.lamp_settles);
            }
            Doing::Still(sample, left) => {
                self.doing = Doing::Still(sample, left.saturating_sub(elapsed));
            }
            Doing::Lit(sample, 0) => {
                let reading = match self.photometer.read_lit(&sample.directions) {
                    Ok(reading) => reading,
                    Err(error) => return self.unread(sample, error),
                };
                self.photometer.light(false)?;
                self.doing = Doing::Nothing;
                let index = sample.index;
                return Ok(Some(Done::Read { index, reading }));
            }
            Doing::Lit(sample, left) => {
                self.doing = Doing::Lit(sample, left.saturating_sub(elapsed));
            }
        }
        Ok(None)
    }

    /// Ends the reading of a sample by an error of the converter, which may be gone in the next attempt. Other errors
    /// would come again.
    fn unread(&mut self, sample: Sample, error: SensorError) -> Result<Option<Done>, StationError> {
        if error != SensorError::Converter {
            return Err(error.into());
        }
        self.photometer.light(false)?;
        self.doing = Doing::Nothing;
        let index = sample.index;
        Ok(Some(Done::Unread { index, error }))
    }
}
