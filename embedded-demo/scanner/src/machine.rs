//! Arms and sensor.

use crate::goniometer::{Goniometer, Progress, StepCheck};
use embassy_time::{Instant, Timer};
use embedded_hal::digital::{InputPin, OutputPin};
use glimpse_core::error::Error;
use glimpse_core::geometry::ArmAngles;
use glimpse_core::gonio::Reading;

/// Arms and sensor.
///
/// After an error, and when a future is dropped before its end, [`stop`](Self::stop) is called, and nothing moves until
/// [`home`](Self::home).
pub trait Machine {
    /// Homes the arms. The result is evidence about the readings since the previous homing.
    ///
    /// # Errors
    /// The error of an axis.
    async fn home(&mut self) -> Result<StepCheck, Error>;

    /// Moves the arms, angles in radians.
    ///
    /// # Errors
    /// The error of an axis. Nothing moves until the arms are homed.
    async fn move_to(&mut self, arms: ArmAngles) -> Result<(), Error>;

    /// Reads the sensor: a BRDF in linear RGB, sr^-1, not times the cosine.
    ///
    /// # Errors
    /// The error of the sensor.
    async fn read(&mut self) -> Result<Reading, Error>;

    /// Stops the arms at once. They must be homed before they move again.
    fn stop(&mut self);
}

/// A sensor.
pub trait Sensor {
    /// Reads a BRDF in linear RGB, sr^-1, not times the cosine, with the arms at these angles.
    ///
    /// # Errors
    /// [`ErrorCode::Sensor`](glimpse_core::error::ErrorCode::Sensor) if the sensor does not answer.
    async fn read(&mut self, arms: &ArmAngles) -> Result<Reading, Error>;
}

/// Time between polls of the axes, in µs. A late poll makes an axis slower, but loses no steps.
const POLL_US: u64 = 20;

/// A machine with four stepper axes.
#[derive(Debug)]
pub struct Steppers<S, D, H, R> {
    arms: Goniometer<S, D, H>,
    sensor: R,
    at: ArmAngles,
    polled: Instant,
}

impl<S: OutputPin, D: OutputPin, H: InputPin, R> Steppers<S, D, H, R> {
    /// Combines arms and sensor.
    pub fn new(arms: Goniometer<S, D, H>, sensor: R) -> Self {
        Self {
            arms,
            sensor,
            at: ArmAngles::default(),
            polled: Instant::now(),
        }
    }

    /// Polls the arms until they rest.
    async fn settle(&mut self) -> Result<Progress, Error> {
        self.polled = Instant::now();
        loop {
            Timer::after_micros(POLL_US).await;
            let now = Instant::now();
            let elapsed = now.duration_since(self.polled).as_micros();
            self.polled = now;
            let elapsed_us = u32::try_from(elapsed).unwrap_or(u32::MAX);
            match self.arms.poll(elapsed_us)? {
                Progress::Moving => {}
                progress => return Ok(progress),
            }
        }
    }
}

impl<S: OutputPin, D: OutputPin, H: InputPin, R: Sensor> Machine for Steppers<S, D, H, R> {
    async fn home(&mut self) -> Result<StepCheck, Error> {
        self.arms.home()?;
        match self.settle().await? {
            Progress::Homed(check) => Ok(check),
            _ => Ok(StepCheck::Unknown),
        }
    }

    async fn move_to(&mut self, arms: ArmAngles) -> Result<(), Error> {
        let ArmAngles { incoming, outgoing } = arms;
        let angles = [incoming.theta, incoming.phi, outgoing.theta, outgoing.phi];
        self.at = arms;
        self.arms.go_to(angles)?;
        self.settle().await.map(drop)
    }

    async fn read(&mut self) -> Result<Reading, Error> {
        self.sensor.read(&self.at).await
    }

    fn stop(&mut self) {
        self.arms.stop();
    }
}
