//! The instrument: arms, lamp and sensor.

use embassy_time::{Instant, Timer};
use embedded_hal::digital::{InputPin, OutputPin};
use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::geometry::Arms;

use crate::goniometer::{Goniometer, Motion, StepCheck};
use crate::optics::{Counts, Sensor};

/// Time between polls of the axes, in µs. A late poll makes an axis slower, but loses no steps.
const POLL_US: u64 = 20;

/// An instrument with four stepper axes, a lamp and a sensor, which [`run`](crate::run) moves.
#[derive(Debug)]
pub struct Instrument<S, H, R> {
    pub(crate) arms: Goniometer<S, H>,
    /// The lamp is on while it is high.
    lamp: S,
    sensor: R,
}

impl<S: OutputPin, H: InputPin, R: Sensor> Instrument<S, H, R> {
    /// Combines arms, a pin that switches the lamp on while it is high, and a sensor.
    pub fn new(arms: Goniometer<S, H>, lamp: S, sensor: R) -> Self {
        Self { arms, lamp, sensor }
    }

    /// Homes the arms. The result is evidence about the readings since the previous homing.
    ///
    /// # Errors
    /// Of the arms.
    pub(crate) async fn home(&mut self) -> Result<StepCheck, Error> {
        self.arms.home()?;
        loop {
            // A route to the switches ends with an arrival.
            if let Some(check) = self.settle().await? {
                return Ok(check);
            }
        }
    }

    /// Moves the arms.
    ///
    /// # Errors
    /// Of the arms. Nothing moves until they are homed.
    pub(crate) async fn move_to(&mut self, arms: Arms) -> Result<(), Error> {
        self.arms.go_to(arms.to_array())?;
        self.settle().await.map(drop)
    }

    /// Reads the sensor with the lamp on or off, which is on afterwards.
    ///
    /// # Errors
    /// [`ErrorCode::Pin`], or those of the sensor.
    pub(crate) async fn counts(&mut self, is_lit: bool) -> Result<Counts, Error> {
        self.light(is_lit)?;
        let counts = self.sensor.counts(is_lit).await;
        self.light(true)?;
        counts
    }

    fn light(&mut self, is_lit: bool) -> Result<(), Error> {
        let set = self.lamp.set_state(is_lit.into());
        set.map_err(|_| Error::new(ErrorCode::LampPin))
    }

    /// Polls the arms until they rest. Returns the result of a homing.
    async fn settle(&mut self) -> Result<Option<StepCheck>, Error> {
        let mut polled = Instant::now();
        loop {
            Timer::after_micros(POLL_US).await;
            let now = Instant::now();
            let elapsed = now.duration_since(polled).as_micros();
            polled = now;
            let elapsed_us = u32::try_from(elapsed).unwrap_or(u32::MAX);
            match self.arms.poll(elapsed_us)? {
                Motion::Moving => {}
                Motion::Homed(check) => return Ok(Some(check)),
                Motion::Resting => return Ok(None),
            }
        }
    }
}
