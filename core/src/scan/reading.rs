//! A reading of the sensor.

use serde::{Deserialize, Serialize};

use super::memory::{is_clamped, measured_brdf, set_measured_brdf};
use super::status::Status;
use crate::error::{Error, ErrorCode};
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
/// use glimpse_core::error::{Error, ErrorCode};
/// use glimpse_core::scan::Reading;
///
/// let white = Reading::new([0.318, 0.318, 0.318]); // a perfect white is 1 / pi
/// assert_eq!(white, Reading::monochrome(0.318)); // of a sensor with one channel
///
/// let saturated = Reading { saturated: true, ..white };
/// assert!(saturated.check(0).is_ok()); // valid; the residual counts saturated readings
///
/// let dark = Reading::new([-0.002, 0.001, 0.0]); // noise after subtraction of a dark reading
/// assert!(dark.check(0).is_ok());
/// let broken = Reading::new([0.1, f32::NAN, 0.1]);
/// assert_eq!(broken.check(7), Err(Error::with(ErrorCode::ReadingNonFinite, [7, 1]))); // sample, channel
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

    /// Checks that the reading of the sample with this index is valid. The index only becomes part of the error.
    ///
    /// # Errors
    /// [`ErrorCode::ReadingNonFinite`], or [`ErrorCode::ReadingNegative`] for a value below [`MIN_READING`].
    pub fn check(&self, index: u16) -> Result<(), Error> {
        for (channel, value) in (0..).zip(self.brdf) {
            if !value.is_finite() {
                let details = [index.into(), channel];
                return Err(Error::with(ErrorCode::ReadingNonFinite, details));
            }
            if value < MIN_READING {
                let details = [index.into(), channel];
                return Err(Error::with(ErrorCode::ReadingNegative, details));
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

/// Returns the slot of a sample.
pub(super) fn slot_mut(slots: &mut [Slot], index: u16) -> Result<&mut Slot, Error> {
    let error = index_error(index, slots.len());
    slots.get_mut(usize::from(index)).ok_or(error)
}

/// Returns the error of an index that the pattern does not have.
pub(super) fn index_error(index: u16, samples: usize) -> Error {
    Error::with(ErrorCode::ReadingIndex, [index.into(), samples as u32])
}

/// Records a reading. The function is not inlined, so that its temporaries leave the stack when it returns.
#[inline(never)]
pub(super) fn record(slots: &mut [Slot], index: u16, reading: Reading) -> Result<Recorded, Error> {
    let slot = slot_mut(slots, index)?;
    reading.check(index)?;
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
pub(super) fn check(slots: &[Slot]) -> Result<Channels, Error> {
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
        return Err(Error::with(
            ErrorCode::ReadingsTooLarge,
            [MAX_QUARTILE as u32, 0],
        ));
    }
    Ok(if gray {
        Channels::Gray
    } else {
        Channels::Color
    })
}
