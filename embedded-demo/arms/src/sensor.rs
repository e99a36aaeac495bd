//! The sensor behind the arms: three channels of counts, and a lamp that can be turned off.

use core::fmt;

use embedded_hal::digital::OutputPin;

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

/// What went wrong with a reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SensorError {
    /// The converter failed.
    Converter,
    /// The lamp's pin could not be written.
    Lamp,
    /// The lamp makes no difference where it should: a white tile is no brighter than darkness.
    Dark,
}

impl fmt::Display for SensorError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Converter => "the sensor's converter failed",
            Self::Lamp => "the lamp's pin could not be written",
            Self::Dark => "white is no brighter than darkness: look at lamp and sensor",
        })
    }
}

impl core::error::Error for SensorError {}

/// Counts of many repetitions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counts {
    /// Their mean, of each channel.
    pub mean: [f32; 3],
    /// The variance of that mean.
    pub variance: [f32; 3],
    /// True if one of them was at the converter's limit.
    pub saturated: bool,
}

/// Sensor and lamp.
#[derive(Debug)]
pub struct Photometer<A, L> {
    sensor: A,
    lamp: L,
    /// The largest count that the converter gives.
    full_scale: u16,
    /// How often it is read for one reading.
    repeats: u16,
}

impl<A: Sensor, L: OutputPin> Photometer<A, L> {
    /// A sensor whose largest count is `full_scale`, read `repeats` times for each reading, and a
    /// lamp that is on when its pin is high.
    pub fn new(sensor: A, lamp: L, full_scale: u16, repeats: u16) -> Self {
        Self {
            sensor,
            lamp,
            full_scale,
            repeats: repeats.max(1),
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

    /// Counts as they are now, averaged.
    ///
    /// # Errors
    /// [`SensorError::Converter`].
    pub fn counts(&mut self) -> Result<Counts, SensorError> {
        let mut counts = Counts::default();
        let mut squares = [0.0_f32; 3];
        for repeat in 1..=self.repeats {
            let read = self.sensor.read().map_err(|_| SensorError::Converter)?;
            for ((count, mean), squares) in
                read.into_iter().zip(&mut counts.mean).zip(&mut squares)
            {
                // Welford's: no difference of large numbers.
                let before = f32::from(count) - *mean;
                *mean += before / f32::from(repeat);
                *squares += before * (f32::from(count) - *mean);
                counts.saturated |= count >= self.full_scale;
            }
        }
        let pairs = f32::from(self.repeats) * f32::from((self.repeats - 1).max(1));
        counts.variance = squares.map(|squares| squares / pairs);
        Ok(counts)
    }
}
