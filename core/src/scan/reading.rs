//! A reading of the sensor.

use serde::{Deserialize, Serialize};

use super::FitError;
use super::memory::{is_clamped, measured_brdf, set_measured_brdf};
use super::status::Status;
use crate::error_code::ErrorCode;
use crate::fit::Channels;
use crate::gonio::Calibrated;
use crate::model::Slot;

/// The smallest valid reading after subtraction of the dark reading, sr^-1: three times as far below 0 as a perfect
/// white is above it. A smaller value is not noise: the dark reading or the sign is wrong.
pub const MIN_READING: f32 = -1.0;

/// A limit in sr^-1 that no material exceeds at more than three quarters of its readings: thirty times a perfect white.
///
/// A metal may exceed it at half of its readings, in the highlight and towards grazing angles, which learned patterns
/// prefer (for example nickel with Neural's pattern). The lower quartile of every material of MERL and RGL is at most
/// 1.2, with each of the four models' patterns.
const MAX_QUARTILE: f32 = 10.0;
/// The smallest number of samples for this check. Fewer samples may all lie in the highlight.
const MIN_SAMPLES: usize = 4;

/// A reading of the sensor.
///
/// ```
/// use glimpse_core::scan::{Reading, ReadingError};
///
/// let white = Reading::new([0.318, 0.318, 0.318]); // a perfect white is 1 / pi
/// assert_eq!(white, Reading::monochrome(0.318)); // of a sensor with one channel
///
/// let saturated = Reading { saturated: true, ..white };
/// assert!(saturated.check().is_ok()); // valid; the residual counts saturated readings
///
/// let dark = Reading::new([-0.002, 0.001, 0.0]); // noise after subtraction of a dark reading
/// assert!(dark.check().is_ok());
/// let broken = Reading::new([0.1, f32::NAN, 0.1]);
/// assert_eq!(broken.check(), Err(ReadingError::NonFinite(1)));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Reading {
    /// The BRDF in linear RGB, sr^-1 (not times the cosine). Noise may bring it slightly below 0.
    pub brdf: [f32; 3],
    /// True if the sensor was saturated, so that the true value is larger.
    pub saturated: bool,
}

impl Reading {
    /// A reading without saturation, from the BRDF in linear RGB, sr^-1, not times the cosine.
    #[must_use]
    pub const fn new(brdf: [f32; 3]) -> Self {
        Self {
            brdf,
            saturated: false,
        }
    }

    /// A reading of a sensor with one channel. If all readings of a scan are monochrome, the fitted material is gray:
    /// its three channels are equal, to the bit.
    #[must_use]
    pub const fn monochrome(brdf: f32) -> Self {
        Self::new([brdf; 3])
    }

    /// Checks that the reading is valid.
    ///
    /// # Errors
    /// [`ReadingError::NonFinite`], or [`ReadingError::Negative`] for a value below [`MIN_READING`].
    pub fn check(&self) -> Result<(), ReadingError> {
        for (channel, value) in (0..).zip(self.brdf) {
            if !value.is_finite() {
                return Err(ReadingError::NonFinite(channel));
            }
            if value < MIN_READING {
                return Err(ReadingError::Negative(channel));
            }
        }
        Ok(())
    }
}

impl From<Calibrated> for Reading {
    fn from(Calibrated { brdf, saturated }: Calibrated) -> Self {
        Self { brdf, saturated }
    }
}

/// The result of recording a reading.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Recorded {
    /// True if the reading replaced an earlier one.
    pub replaced: bool,
    /// True if a channel is too far below 0 for the loss. The fit clamps it to the smallest value that the loss
    /// accepts; [`Residual::clamped`](super::Residual::clamped) counts such readings.
    pub clamped: bool,
}

/// An invalid reading. Take it again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ReadingError {
    /// A channel (0 red, 1 green, 2 blue) is NaN or infinite.
    NonFinite(u8),
    /// A channel (0 red, 1 green, 2 blue) is below [`MIN_READING`].
    Negative(u8),
    /// The recipe's pattern has no sample with this index.
    Index {
        /// The index.
        index: u16,
        /// Number of samples of the pattern.
        samples: u16,
    },
}

impl ReadingError {
    /// The error's code.
    #[must_use]
    pub const fn code(&self) -> ErrorCode {
        match self {
            Self::NonFinite(_) => ErrorCode::ReadingNonFinite,
            Self::Negative(_) => ErrorCode::ReadingNegative,
            Self::Index { .. } => ErrorCode::ReadingIndex,
        }
    }
}

impl core::fmt::Display for ReadingError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NonFinite(channel) => write!(f, "channel {channel} is not a finite number"),
            Self::Negative(channel) => write!(
                f,
                "channel {channel} is below {MIN_READING} sr^-1, which is not noise: check the dark reading"
            ),
            Self::Index { index, samples } => {
                write!(
                    f,
                    "sample {index} does not exist: the pattern has {samples}"
                )
            }
        }
    }
}

impl core::error::Error for ReadingError {}

/// Records a reading. The function is not inlined, so that its temporaries leave the stack when it returns.
#[inline(never)]
pub(super) fn record(
    slots: &mut [Slot],
    index: u16,
    reading: Reading,
) -> Result<Recorded, ReadingError> {
    let samples = slots.len() as u16;
    let Some(slot) = slots.get_mut(usize::from(index)) else {
        return Err(ReadingError::Index { index, samples });
    };
    reading.check()?;
    set_measured_brdf(slot, reading.brdf);
    let recorded = Recorded {
        replaced: Status::of(slot).is_read(),
        clamped: is_clamped(slot),
    };
    Status::read(reading.saturated).put(slot);
    Ok(recorded)
}

/// Checks the readings of a fit. It rejects readings that are too large for any material, such as raw counts. Returns
/// gray if all readings that count are gray.
#[inline(never)]
pub(super) fn check(slots: &[Slot]) -> Result<Channels, FitError> {
    // A sample that does not count may still hold a reading of the previous material.
    let counted = slots.iter().filter(|slot| Status::of(slot).counts());
    let values = counted.clone().flat_map(measured_brdf);
    let too_large = values.filter(|value| *value > MAX_QUARTILE).count();
    let is_gray = |slot: &Slot| {
        let [red, green, blue] = measured_brdf(slot).map(f32::to_bits);
        red == green && green == blue
    };
    let gray = counted.clone().all(is_gray);
    let counted = counted.count();
    let all = counted.saturating_mul(3);
    if counted >= MIN_SAMPLES && too_large.saturating_mul(4) > all.saturating_mul(3) {
        return Err(FitError::TooLarge {
            limit: MAX_QUARTILE as u16,
        });
    }
    Ok(if gray {
        Channels::Gray
    } else {
        Channels::Color
    })
}
