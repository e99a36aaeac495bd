//! The sensor: three channels of counts, and a lamp that can be switched.

use core::fmt;

use embedded_hal::digital::OutputPin;
use glimpse_core::geometry::Directions;
use glimpse_core::gonio::{Calibration, CalibrationError, Footprint, Repeated};
use glimpse_core::scan::Reading;

/// A sensor of three channels. (embedded-hal 1.0 has no trait for analog-to-digital converters.) A sensor with one
/// channel returns the same count three times.
pub trait Sensor {
    /// The error of the analog-to-digital converter.
    type Error;

    /// Returns the present counts of red, green and blue.
    ///
    /// # Errors
    /// If the converter fails.
    fn read(&mut self) -> Result<[u16; 3], Self::Error>;
}

/// Calibration of the sensor by one reading of a white tile.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct WhiteTile {
    /// Counts of the tile, minus those in the dark.
    pub counts: [f32; 3],
    /// Reflectance of the tile, 0 to 1.
    pub reflectance: [f32; 3],
    /// Directions of lamp and sensor at the tile.
    pub directions: Directions<f32>,
    /// The larger of the two spots on the sample: the lamp's or the sensor's.
    pub footprint: Footprint,
    /// The maximum count of the converter.
    pub full_scale: u16,
}

/// An error of the sensor or the lamp.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SensorError {
    /// The converter failed.
    Converter,
    /// The lamp's pin could not be written.
    Lamp,
    /// The counts cannot be converted to a BRDF.
    Calibration(CalibrationError),
}

impl fmt::Display for SensorError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Converter => {
                f.write_str("the sensor's converter failed: check its wires and supply")
            }
            Self::Lamp => {
                f.write_str("the lamp's pin could not be written: check the pin's configuration")
            }
            Self::Calibration(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for SensorError {}

/// A photometer: sensor and lamp.
#[derive(Debug)]
pub struct Photometer<A, L> {
    sensor: A,
    lamp: L,
    white: WhiteTile,
    /// Number of sensor readings that are averaged to one reading.
    repeats: u16,
    dark: Repeated,
}

impl<A: Sensor, L: OutputPin> Photometer<A, L> {
    /// Creates a photometer whose sensor is read `repeats` times for each reading. The lamp is on when its pin is high.
    pub fn new(sensor: A, lamp: L, white: WhiteTile, repeats: u16) -> Self {
        Self {
            sensor,
            lamp,
            white,
            repeats: repeats.max(1),
            dark: Repeated::new(),
        }
    }

    /// Turns the lamp on or off. The caller waits until the lamp is steady.
    ///
    /// # Errors
    /// [`SensorError::Lamp`].
    pub fn set_lamp(&mut self, on: bool) -> Result<(), SensorError> {
        self.lamp
            .set_state(on.into())
            .map_err(|_| SensorError::Lamp)
    }

    /// Reads the dark counts, which are subtracted from the next reading. The lamp must be off.
    ///
    /// # Errors
    /// If the converter fails.
    pub fn read_dark(&mut self) -> Result<(), SensorError> {
        self.dark = self.average_counts()?;
        Ok(())
    }

    /// Reads the sample. The lamp must be on, and lamp and sensor at `directions`. The scan checks the validity of the
    /// reading.
    ///
    /// # Errors
    /// If the converter fails, or the counts cannot be converted to a BRDF.
    pub fn read_lit(&mut self, directions: &Directions<f32>) -> Result<Reading, SensorError> {
        let counts = self.average_counts()?;
        let dark = self.dark.mean().unwrap_or_default();
        self.calibrate(dark, counts, directions)
            .map_err(SensorError::Calibration)
    }

    fn calibrate(
        &self,
        dark: [f32; 3],
        counts: Repeated,
        directions: &Directions<f32>,
    ) -> Result<Reading, CalibrationError> {
        let WhiteTile {
            counts: white,
            reflectance,
            directions: reference,
            footprint,
            ..
        } = self.white;
        let [dark_r, dark_g, dark_b] = dark;
        let [white_r, white_g, white_b] = white;
        let white = [dark_r + white_r, dark_g + white_g, dark_b + white_b];
        let calibrated = Calibration::new(dark, white, reflectance)?
            .read_once_at(&reference, footprint)?
            .brdf(counts.mean().unwrap_or_default(), directions)?;
        Ok(Reading {
            brdf: calibrated.brdf,
            saturated: counts.saturated() || self.dark.saturated(),
        })
    }

    /// Reads the sensor `repeats` times, and averages the counts.
    fn average_counts(&mut self) -> Result<Repeated, SensorError> {
        let mut counts = Repeated::new();
        for _ in 0..self.repeats {
            let read = self.sensor.read().map_err(|_| SensorError::Converter)?;
            let saturated = read.iter().any(|count| *count >= self.white.full_scale);
            // Counts are always finite.
            let _ = counts.add(read.map(f32::from), saturated);
        }
        Ok(counts)
    }
}
