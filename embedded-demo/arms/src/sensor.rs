//! The sensor behind the arms: three channels of counts, and a lamp that can be turned off.

use core::fmt;

use embedded_hal::digital::OutputPin;
use glimpse_core::geometry::Directions;
use glimpse_core::gonio::{Calibration, CalibrationError, Footprint, Repeated};
use glimpse_core::scan::Reading;

/// A sensor of three channels. (embedded-hal 1.0 has no trait for converters.) One of one channel
/// gives the same count three times.
pub trait Sensor {
    /// What the converter may fail with.
    type Error;

    /// Counts of red, green and blue, now.
    ///
    /// # Errors
    /// If the converter fails.
    fn read(&mut self) -> Result<[u16; 3], Self::Error>;
}

/// What is known of the sensor: read once, off a white tile.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct White {
    /// Counts above dark that the tile gave.
    pub counts: [f32; 3],
    /// The tile's reflectance, a fraction.
    pub reflectance: [f32; 3],
    /// Where lamp and sensor were.
    pub at: Directions<f32>,
    /// Whose spot on the sample is the larger one.
    pub footprint: Footprint,
    /// The largest count that the converter gives.
    pub full_scale: u16,
}

/// What went wrong with a reading.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SensorError {
    /// The converter failed.
    Converter,
    /// The lamp's pin could not be written.
    Lamp,
    /// Its counts are no BRDF.
    Calibration(CalibrationError),
}

impl fmt::Display for SensorError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Converter => f.write_str("the sensor's converter failed"),
            Self::Lamp => f.write_str("the lamp's pin could not be written"),
            Self::Calibration(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for SensorError {}

/// Sensor and lamp.
#[derive(Debug)]
pub struct Photometer<A, L> {
    sensor: A,
    lamp: L,
    white: White,
    /// How often the sensor is read for one reading.
    repeats: u16,
    dark: Repeated,
}

impl<A: Sensor, L: OutputPin> Photometer<A, L> {
    /// A sensor that is read `repeats` times for each reading, and a lamp that is on when its pin is
    /// high.
    pub fn new(sensor: A, lamp: L, white: White, repeats: u16) -> Self {
        Self {
            sensor,
            lamp,
            white,
            repeats: repeats.max(1),
            dark: Repeated::new(),
        }
    }

    /// Turns the lamp on or off. It takes its time to settle, which is the caller's.
    ///
    /// # Errors
    /// [`SensorError::Lamp`].
    pub fn light(&mut self, on: bool) -> Result<(), SensorError> {
        self.lamp
            .set_state(on.into())
            .map_err(|_| SensorError::Lamp)
    }

    /// Reads darkness, which is subtracted from what is read in light next. The lamp is off.
    ///
    /// # Errors
    /// If the converter fails.
    pub fn read_dark(&mut self) -> Result<(), SensorError> {
        self.dark = self.counts()?;
        Ok(())
    }

    /// Reads the sample. The lamp is on, and lamp and sensor are `at` these directions. Whether the
    /// reading can be one at all is the scan's to say, which tries more than once.
    ///
    /// # Errors
    /// If the converter fails, or its counts are no BRDF.
    pub fn read_lit(&mut self, at: &Directions<f32>) -> Result<Reading, SensorError> {
        let counts = self.counts()?;
        let dark = self.dark.mean().unwrap_or_default();
        self.calibrate(dark, counts, at)
            .map_err(SensorError::Calibration)
    }

    fn calibrate(
        &self,
        dark: [f32; 3],
        counts: Repeated,
        at: &Directions<f32>,
    ) -> Result<Reading, CalibrationError> {
        let White {
            counts: above,
            reflectance,
            at: reference,
            footprint,
            ..
        } = self.white;
        let [r, g, b] = dark;
        let [white_r, white_g, white_b] = above;
        let white = [r + white_r, g + white_g, b + white_b];
        let calibrated = Calibration::new(dark, white, reflectance)?
            .read_once_at(&reference, footprint)?
            .brdf(counts.mean().unwrap_or_default(), at)?;
        Ok(Reading {
            brdf: calibrated.brdf,
            saturated: counts.saturated() || self.dark.saturated(),
        })
    }

    /// Counts as they are now, averaged.
    fn counts(&mut self) -> Result<Repeated, SensorError> {
        let mut counts = Repeated::new();
        for _ in 0..self.repeats {
            let read = self.sensor.read().map_err(|_| SensorError::Converter)?;
            let saturated = read.iter().any(|count| *count >= self.white.full_scale);
            // Counts are finite.
            let _ = counts.add(read.map(f32::from), saturated);
        }
        Ok(counts)
    }
}
