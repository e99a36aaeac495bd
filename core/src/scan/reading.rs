//! A reading of the sensor.

use serde::{Deserialize, Serialize};

use super::FitError;
use super::memory::{measured_at, place_of, put_measured};
use super::status::Status;
use crate::error_code::ErrorCode;
use crate::fit::{Channels, FitMethod};
use crate::gonio::Calibrated;
use crate::model::Slot;
use crate::recipe::Recipe;

/// The least that a dark-subtracted reading may be, sr^-1: three times as far below 0 as a perfect
/// white is above it. What is less is no noise, but a wrong dark reading or a wrong sign.
pub const MIN_READING: f32 = -1.0;

/// What more than three quarters of a material's readings never are, sr^-1: thirty times a perfect
/// white. A metal's may be at half of them, in its highlight and towards grazing angles, where learned
/// patterns like to look (nickel, with Neural's); but the lower quartile of no material of MERL and
/// RGL, with any of the four models' patterns, is above 1.2.
const IMPLAUSIBLE: f32 = 10.0;
/// Fewer samples may all lie in the highlight.
const MIN_SAMPLES: usize = 4;

/// A reading of the sensor.
///
/// ```
/// use glimpse_core::scan::{Reading, ReadingError};
///
/// let white = Reading::new([0.318, 0.318, 0.318]); // a perfect white is 1 / pi
/// assert_eq!(white, Reading::monochrome(0.318)); // by a sensor with one channel
///
/// let at_its_end = Reading { saturated: true, ..white };
/// assert!(at_its_end.check().is_ok()); // it counts; the residual tells how many there were
///
/// let dark = Reading::new([-0.002, 0.001, 0.0]); // noise about a dark reading
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
    /// A reading of a sensor that was not saturated: the BRDF in linear RGB, sr^-1, not times the
    /// cosine.
    #[must_use]
    pub const fn new(brdf: [f32; 3]) -> Self {
        Self {
            brdf,
            saturated: false,
        }
    }

    /// A reading of a sensor with one channel: if all readings of a scan are, the fitted
    /// material is gray: its three channels are equal, to the bit.
    #[must_use]
    pub const fn monochrome(brdf: f32) -> Self {
        Self::new([brdf; 3])
    }

    /// Checks that it is a possible reading.
    ///
    /// # Errors
    /// [`ReadingError::NonFinite`], or [`ReadingError::Negative`] below [`MIN_READING`].
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
    /// It took the place of an earlier one.
    pub replaced: bool,
    /// A channel was so far below 0 that the loss could not take it, and was brought up to what it
    /// can: [`Residual::clamped`](super::Residual::clamped) counts such readings.
    pub clamped: bool,
}

/// An invalid reading, which has to be taken again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ReadingError {
    /// A channel (0 red, 1 green, 2 blue) is NaN or infinite.
    NonFinite(u8),
    /// A channel is further below 0 than noise can be.
    Negative(u8),
    /// The recipe's pattern has no sample with this index.
    Index {
        /// The index.
        index: u16,
        /// How many samples there are.
        samples: u16,
    },
}

impl ReadingError {
    /// The code.
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
                "channel {channel} is below {MIN_READING} sr^-1, further than noise can be: look at the dark reading"
            ),
            Self::Index { index, samples } => {
                write!(f, "there is no sample {index}: the pattern has {samples}")
            }
        }
    }
}

impl core::error::Error for ReadingError {}

/// Takes a reading. Out of line: its temporaries leave the stack with it.
#[inline(never)]
pub(super) fn record(
    slots: &mut [Slot],
    recipe: &Recipe<'_>,
    index: u16,
    reading: Reading,
) -> Result<Recorded, ReadingError> {
    reading.check()?;
    let samples = slots.len() as u16;
    let Some(slot) = slots.get_mut(usize::from(index)) else {
        return Err(ReadingError::Index { index, samples });
    };
    let min = recipe
        .method
        .min_reading(usize::from(index), &place_of(slot));
    let recorded = Recorded {
        replaced: Status::of(slot).is_read(),
        clamped: reading.brdf.iter().any(|value| *value < min),
    };
    put_measured(slot, reading.brdf);
    Status::read(reading.saturated, recorded.clamped).put(slot);
    Ok(recorded)
}

/// Refuses readings that are too large for any material, such as a sensor's raw counts; notes which readings
/// repeat the one before; and raises what is too far below 0 for the fit. Returns whether all that count are gray.
#[inline(never)]
pub(super) fn prepare(slots: &mut [Slot], method: &FitMethod<'_>) -> Result<Channels, FitError> {
    // A sample that does not count may still hold the reading of another material.
    let counted = slots.iter().filter(|slot| Status::of(slot).counts());
    let values = counted.clone().flat_map(measured_at);
    let too_large = values.filter(|value| *value > IMPLAUSIBLE).count();
    let is_gray = |slot: &Slot| {
        let [red, green, blue] = measured_at(slot).map(f32::to_bits);
        red == green && green == blue
    };
    let gray = counted.clone().all(is_gray);
    let counted = counted.count();
    let all = counted.saturating_mul(3);
    if counted >= MIN_SAMPLES && too_large.saturating_mul(4) > all.saturating_mul(3) {
        return Err(FitError::TooLarge {
            limit: IMPLAUSIBLE as u16,
        });
    }
    note_repeated(slots);
    for (index, slot) in slots.iter_mut().enumerate() {
        let status = Status::of(slot);
        if status.is_clamped() {
            let min = method.min_reading(index, &place_of(slot));
            put_measured(slot, measured_at(slot).map(|value| value.max(min)));
            status.raised().put(slot);
        }
    }
    Ok(if gray {
        Channels::Gray
    } else {
        Channels::Color
    })
}

/// Notes which readings are equal, bit for bit, to the one before them in the pattern. One that a fit has raised
/// already is no longer what was read: flags stay beside it.
fn note_repeated(slots: &mut [Slot]) {
    let mut before = None;
    for slot in slots {
        let status = Status::of(slot);
        if !status.is_read() {
            continue;
        }
        let bits = measured_at(slot).map(f32::to_bits);
        if let Some((earlier, was_raised)) = before.replace((bits, status.is_raised()))
            && !(was_raised || status.is_raised())
        {
            status.repeated(earlier == bits).put(slot);
        }
    }
}
