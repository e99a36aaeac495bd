//! A reading of the sensor.

use serde::{Deserialize, Serialize};

use crate::error::{Error, ErrorCode};

/// The smallest valid reading after subtraction of the dark reading, sr^-1: three times as far below 0 as a perfect
/// white is above it. A smaller value is not noise: the dark reading or the sign is wrong.
pub const MIN_READING: f32 = -1.0;

/// A reading of the sensor.
///
/// ```
/// use glimpse_core::error::{Error, ErrorCode};
/// use glimpse_core::gonio::Reading;
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
