//! Counts of a sensor, and their conversion to the BRDF.

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::geometry::Arms;
use glimpse_core::gonio::{Calibration, Footprint, Reading};

/// Counts of red, green and blue, linear, as with the nominal exposure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Counts {
    /// The counts.
    pub channels: [f32; 3],
    /// True if the true counts are larger.
    pub is_saturated: bool,
}

impl core::fmt::Display for Counts {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let [red, green, blue] = self.channels.map(|count| count as u32);
        let saturated = if self.is_saturated { ", saturated" } else { "" };
        write!(f, "counts {red}, {green}, {blue}{saturated}")
    }
}

/// A sensor.
pub trait Sensor {
    /// Reads the counts. If it `adapts`, a sensor with several exposures chooses one; the counts are those of the nominal
    /// one. A sensor with one channel returns it three times.
    ///
    /// # Errors
    /// [`ErrorCode::Sensor`] if it does not answer, [`ErrorCode::SensorReset`] if it has lost its settings.
    async fn counts(&mut self, adapts: bool) -> Result<Counts, Error>;
}

/// The white tile.
#[derive(Clone, Copy, Debug)]
pub struct White {
    /// The arms while it is read: at least 20 degrees away from the mirror's direction.
    pub at: Arms,
    /// Its reflectance in each channel, above 0 (a fraction, not per cent).
    pub reflectance: [f32; 3],
    /// The larger spot on the sample, at all angles: that of the light, or that which the sensor sees.
    pub footprint: Footprint,
}

/// The largest counts with the lamp off, above those of the calibration, as a part of the white.
const MAX_ROOM_LIGHT: f32 = 0.25;
/// The smallest counts, as a part of the white, that noise changes between any two readings.
const NOISY: f32 = 0.01;
/// Number of equal readings in a row that only a sensor that is stuck has.
const STUCK: u8 = 3;

/// The conversion of counts in one scan.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Optics {
    white: White,
    /// Counts of the calibration: dark, and white less dark.
    dark: [f32; 3],
    span: [f32; 3],
    /// Counts with the lamp off, at the beginning of the scan.
    room: Option<[f32; 3]>,
    last: [f32; 3],
    repeated: u8,
}

impl Optics {
    /// Creates the conversion from the counts of a calibration.
    ///
    /// # Errors
    /// As [`Calibration::new`].
    pub(crate) fn new(white: White, dark: [f32; 3], counts: [f32; 3]) -> Result<Self, Error> {
        Calibration::new(dark, counts, white.reflectance)?;
        let mut spans = counts.into_iter().zip(dark);
        Ok(Self {
            white,
            dark,
            span: dark.map(|_| spans.next().map_or(0.0, |(white, dark)| white - dark)),
            room: None,
            last: [0.0; 3],
            repeated: 0,
        })
    }

    /// Converts counts at these angles. Those with the lamp off at the beginning of a scan are subtracted from all others.
    ///
    /// # Errors
    /// [`ErrorCode::LampStuck`], [`ErrorCode::SensorStuck`], or as
    /// [`ReferenceCalibration::reading`](glimpse_core::gonio::ReferenceCalibration::reading).
    pub(crate) fn reading(
        &mut self,
        counts: Counts,
        arms: &Arms,
        is_lit: bool,
    ) -> Result<Reading, Error> {
        let channels = counts.channels;
        let exceeds = |by: f32| {
            let references = self.dark.into_iter().zip(self.span);
            let mut all = channels.into_iter().zip(references);
            all.any(|(count, (dark, span))| count - dark > by * span)
        };
        if !is_lit && exceeds(MAX_ROOM_LIGHT) {
            let largest = channels.into_iter().fold(0.0, f32::max);
            return Err(Error::with(ErrorCode::LampStuck, [largest as u32, 0]));
        }
        let is_same = channels == self.last && exceeds(NOISY) && !counts.is_saturated;
        self.repeated = if is_same {
            self.repeated.saturating_add(1)
        } else {
            1
        };
        self.last = channels;
        if self.repeated >= STUCK {
            return Err(Error::new(ErrorCode::SensorStuck));
        }
        if !is_lit && self.room.is_none() {
            self.room = Some(channels);
        }
        let dark = self.room.unwrap_or(self.dark);
        let mut spans = dark.into_iter().zip(self.span);
        let white = dark.map(|_| spans.next().map_or(0.0, |(dark, span)| dark + span));
        let reading = Calibration::new(dark, white, self.white.reflectance)?
            .read_once_at(&self.white.at.directions(), self.white.footprint)?
            .reading(channels, &arms.directions())?;
        Ok(Reading {
            saturated: counts.is_saturated,
            ..reading
        })
    }
}
