//! Arms, lamp and sensor as one machine: it goes where it is told, and reads. It never waits.

use core::f32::consts::TAU;
use core::fmt;

use embedded_hal::digital::{InputPin, OutputPin};
use glimpse_core::geometry::{ArmAngles, Directions, Spherical};
use glimpse_core::gonio::{Machine, Move};
use glimpse_core::scan::Reading;

use crate::axis::Motion;
use crate::goniometer::{ArmError, Goniometer, LostSteps};
use crate::sensor::{Photometer, Sensor, SensorError};

/// theta_i, phi_i, theta_o, phi_o.
pub const ARMS: usize = 4;

/// How a station behaves.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Settings {
    /// How fast its arms are and where they get to: what the nearest directions are.
    pub machine: Machine,
    /// Microseconds until the arms hang still, the lamp off.
    pub arms_settle: u32,
    /// Microseconds until the lamp is steady.
    pub lamp_settles: u32,
}

/// What went wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StationError {
    /// With an arm.
    Arm(ArmError),
    /// With sensor or lamp.
    Sensor(SensorError),
}

impl fmt::Display for StationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Arm(error) => error.fmt(f),
            Self::Sensor(error) => error.fmt(f),
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

/// What a station has done.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Done {
    /// All arms are home, and this is what the first of them had lost that had lost anything.
    Home(Option<LostSteps>),
    /// A sample was read.
    Read {
        /// Its index in the recipe's pattern.
        index: u16,
        /// What the sensor saw.
        reading: Reading,
    },
}

/// What it is about.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Doing {
    Nothing,
    GoingHome,
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
        }
    }

    /// The arms.
    pub fn arms(&self) -> &Goniometer<S, D, H, ARMS> {
        &self.arms
    }

    /// Takes counts from before a reset for true, so that coming home can tell whether they were.
    pub fn assume(&mut self, positions: [i32; ARMS]) {
        self.arms.assume(positions);
    }

    /// Whether it waits for something to do.
    pub fn is_idle(&self) -> bool {
        self.doing == Doing::Nothing
    }

    /// Sends the arms home.
    ///
    /// # Errors
    /// If one of them moves.
    pub fn go_home(&mut self) -> Result<(), StationError> {
        self.photometer.light(false)?;
        self.arms.go_home()?;
        self.doing = Doing::GoingHome;
        Ok(())
    }

    /// The nearest of these samples; None if none is within reach.
    pub fn nearest(&self, pending: impl Iterator<Item = (u16, Directions<f32>)>) -> Option<Move> {
        self.settings.machine.nearest(pending, &self.angles())
    }

    /// Sends the arms to a sample, to read it.
    ///
    /// # Errors
    /// If an arm moves, is not homed or does not reach there, or the lamp cannot be switched.
    pub fn read(&mut self, to: Move, directions: Directions<f32>) -> Result<(), StationError> {
        self.photometer.light(false)?;
        self.arms.go_to(self.within(to.arms))?;
        let index = to.index;
        self.doing = Doing::Going(Sample { index, directions });
        Ok(())
    }

    /// Lets the arms stand, and forgets what it was about. They have to be sent home then.
    pub fn stop(&mut self) {
        self.arms.stop();
        self.doing = Doing::Nothing;
        // The lamp's pin may be what failed.
        let _ = self.photometer.light(false);
    }

    /// Where the arms are by count of their steps.
    fn angles(&self) -> ArmAngles {
        let [theta_i, phi_i, theta_o, phi_o] = self.arms.arms().each_ref().map(|arm| arm.angle());
        let at = |theta, phi| Spherical { theta, phi };
        ArmAngles {
            incoming: at(theta_i, phi_i),
            outgoing: at(theta_o, phi_o),
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
        let [_, phi_i, _, phi_o] = self.arms.arms();
        let [theta_i, i, theta_o, o] = angles;
        let turned = |angle: f32, check: &dyn Fn(f32) -> bool| {
            let ways = [angle, angle - TAU, angle + TAU];
            ways.into_iter().find(|way| check(*way)).unwrap_or(angle)
        };
        [
            theta_i,
            turned(i, &|angle| phi_i.check(angle).is_ok()),
            theta_o,
            turned(o, &|angle| phi_o.check(angle).is_ok()),
        ]
    }

    /// Goes on, `elapsed` microseconds after the last call; what it has done, if it is done.
    ///
    /// # Errors
    /// What went wrong. It stands then, and has to be sent home.
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
            Doing::GoingHome | Doing::Going(_) if motion == Motion::Moving => {}
            Doing::GoingHome => {
                self.doing = Doing::Nothing;
                return Ok(Some(Done::Home(self.arms.lost_steps().next())));
            }
            Doing::Going(sample) => self.doing = Doing::Still(sample, self.settings.arms_settle),
            Doing::Still(sample, 0) => {
                self.photometer.read_dark()?;
                self.photometer.light(true)?;
                self.doing = Doing::Lit(sample, self.settings.lamp_settles);
            }
            Doing::Still(sample, left) => {
                self.doing = Doing::Still(sample, left.saturating_sub(elapsed));
            }
            Doing::Lit(Sample { index, directions }, 0) => {
                let reading = self.photometer.read_lit(&directions)?;
                self.photometer.light(false)?;
                self.doing = Doing::Nothing;
                return Ok(Some(Done::Read { index, reading }));
            }
            Doing::Lit(sample, left) => {
                self.doing = Doing::Lit(sample, left.saturating_sub(elapsed));
            }
        }
        Ok(None)
    }
}
