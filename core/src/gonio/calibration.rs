//! Conversion of counts to the BRDF, with dark and white readings.
//!
//! A sensor counts c = dark + g L. L is the radiance or intensity of the spot that it sees. g is an unknown gain of
//! lamp, lens, distance and exposure, which all stay the same. A white Lambertian tile of reflectance R has the BRDF R
//! / pi everywhere. The BRDF of the sample is therefore
//!
//! f = R / pi (c - dark) / (white - dark)
//!
//! if lamp and sensor are at the **same** directions for both, because all cosines in L cancel ([`Calibration`]). With
//! a white reading at only **one reference** pair of directions, a cosine remains ([`ReferenceCalibration`]). The
//! larger spot on the sample determines the cosine ([`Footprint`]):
//!
//! - If the lamp lights more than the sensor sees, L is a radiance, f E cos(theta_i), and f = R / pi (c - dark) /
//!   (white - dark) cos(theta_i of the reference) / cos(theta_i).
//! - If the sensor sees more than is lit, all of the lamp's flux counts at any theta_i. L is an intensity, f Phi
//!   cos(theta_o), and the cosines are those of theta_o.
//!
//! If neither spot contains the other at all angles, white readings at the same directions are required.

use core::f32::consts::FRAC_1_PI;

use serde::{Deserialize, Serialize};

use super::quantity::cosine;
use super::reading::Reading;
use crate::error::{Error, ErrorCode};
use crate::geometry::{Arm, Directions};

/// Dark counts, white counts, and the white's reflectance. Dark and white are read at the **same directions** as the
/// sample, with the same lamp and exposure.
///
/// ```
/// use glimpse_core::gonio::Calibration;
///
/// let dark = [96.0, 101.0, 99.0];
/// let white = [3100.0, 3600.0, 2900.0]; // a tile of 99 % reflectance at these directions
/// let calibration = Calibration::new(dark, white, [0.99; 3])?.saturating_at(4095.0)?;
///
/// let reading = calibration.reading([620.0, 830.0, 510.0])?;
/// assert!((reading.brdf[0] - 0.99 / 3.14159 * 524.0 / 3004.0).abs() < 1e-6);
/// assert!(!reading.saturated);
/// assert!(calibration.reading([620.0, 4095.0, 510.0])?.saturated);
/// # Ok::<(), glimpse_core::error::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    dark: [f32; 3],
    white: [f32; 3],
    reflectance: [f32; 3],
    saturation: f32,
}

impl Calibration {
    /// Creates a calibration from counts without light, counts of the white tile, and the tile's reflectance in each
    /// channel, above 0 and at most 2 (a fraction, not per cent).
    ///
    /// # Errors
    /// [`ErrorCode::ChannelNonFinite`], [`ErrorCode::WhiteNotBrighter`] or [`ErrorCode::WhiteReflectance`], each with the
    /// channel.
    pub fn new(dark: [f32; 3], white: [f32; 3], reflectance: [f32; 3]) -> Result<Self, Error> {
        let channels = dark.into_iter().zip(white).zip(reflectance);
        for (channel, ((dark, white), reflectance)) in (0..).zip(channels) {
            if !(dark.is_finite() && white.is_finite()) {
                return Err(Error::with(ErrorCode::ChannelNonFinite, [channel, 0]));
            }
            if white <= dark {
                return Err(Error::with(ErrorCode::WhiteNotBrighter, [channel, 0]));
            }
            // This form of the condition rejects NaN too.
            if !(reflectance > 0.0 && reflectance <= 2.0) {
                return Err(Error::with(ErrorCode::WhiteReflectance, [channel, 0]));
            }
        }
        Ok(Self {
            dark,
            white,
            reflectance,
            saturation: f32::INFINITY,
        })
    }

    /// Creates the calibration of a sensor with one channel: all three channels have the same counts.
    ///
    /// # Errors
    /// Fails like [`Calibration::new`], with channel 0.
    pub fn monochrome(dark: f32, white: f32, reflectance: f32) -> Result<Self, Error> {
        Self::new([dark; 3], [white; 3], [reflectance; 3])
    }

    /// Sets the `level` of counts at and above which a reading is saturated.
    ///
    /// # Errors
    /// [`ErrorCode::WhiteSaturated`] with the channel whose white is not below the level. A NaN fails too.
    pub fn saturating_at(self, level: f32) -> Result<Self, Error> {
        for (channel, white) in (0..).zip(self.white) {
            if level.is_nan() || white >= level {
                return Err(Error::with(ErrorCode::WhiteSaturated, [channel, 0]));
            }
        }
        Ok(Self {
            saturation: level,
            ..self
        })
    }

    /// The BRDF of a sample's `counts`, which were read at the same directions as the white.
    ///
    /// # Errors
    /// [`ErrorCode::ChannelNonFinite`] with the channel that is not finite.
    pub fn reading(&self, counts: [f32; 3]) -> Result<Reading, Error> {
        self.scaled(counts, 1.0)
    }

    /// Converts to a calibration for a white that was read once, at `reference` directions.
    ///
    /// # Errors
    /// [`ErrorCode::Directions`] if the reference is at or below the horizon.
    pub fn read_once_at(
        self,
        reference: &Directions<f32>,
        footprint: Footprint,
    ) -> Result<ReferenceCalibration, Error> {
        Ok(ReferenceCalibration {
            calibration: self,
            cosine: cosine(reference, footprint.arm())?,
            footprint,
        })
    }

    fn scaled(&self, counts: [f32; 3], scale: f32) -> Result<Reading, Error> {
        let mut calibrated = Reading {
            brdf: counts,
            saturated: false,
        };
        let references = self.dark.into_iter().zip(self.white).zip(self.reflectance);
        let channels = calibrated.brdf.iter_mut().zip(references);
        for (channel, (value, ((dark, white), reflectance))) in (0..).zip(channels) {
            calibrated.saturated |= *value >= self.saturation;
            *value = (*value - dark) / (white - dark) * (scale * reflectance * FRAC_1_PI);
            if !value.is_finite() {
                return Err(Error::with(ErrorCode::ChannelNonFinite, [channel, 0]));
            }
        }
        Ok(calibrated)
    }
}

/// The larger spot on the sample, at all angles of a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Footprint {
    /// The light's spot: all that the sensor sees is lit. Counts are proportional to f cos(theta_i).
    LightLarger,
    /// The sensor's spot: it sees all that is lit. Counts are proportional to f cos(theta_o).
    SensorLarger,
}

impl Footprint {
    /// Returns the arm whose cosine the counts are proportional to.
    fn arm(self) -> Arm {
        match self {
            Self::LightLarger => Arm::Light,
            Self::SensorLarger => Arm::Sensor,
        }
    }
}

/// A [`Calibration`] whose white was read at one reference pair of directions. [`Calibration::read_once_at`] creates
/// it.
///
/// ```
/// use glimpse_core::geometry::Directions;
/// use glimpse_core::gonio::{Calibration, Footprint};
///
/// // The white faces the lamp and is seen at 45 degrees. The lamp lights all that the sensor sees.
/// let reference = Directions { incoming: [0.0, 0.0, 1.0], outgoing: [0.7071, 0.0, 0.7071] };
/// let calibration = Calibration::monochrome(100.0, 3100.0, 0.99)?
///     .read_once_at(&reference, Footprint::LightLarger)?;
///
/// // A Lambertian gray of half the reflectance, under a lamp at 60 degrees: a quarter of the counts.
/// let at = Directions { incoming: [0.8660, 0.0, 0.5], outgoing: [0.0, 0.0, 1.0] };
/// let reading = calibration.reading([850.0; 3], &at)?;
/// assert!((reading.brdf[0] - 0.5 * 0.99 / 3.14159).abs() < 1e-6);
/// # Ok::<(), glimpse_core::error::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReferenceCalibration {
    calibration: Calibration,
    cosine: f32,
    footprint: Footprint,
}

impl ReferenceCalibration {
    /// The BRDF of a sample's `counts`, which were read at the directions `at`.
    ///
    /// # Errors
    /// [`ErrorCode::ChannelNonFinite`] with the channel, or [`ErrorCode::Directions`] with the arm that is at or below the
    /// horizon.
    pub fn reading(&self, counts: [f32; 3], at: &Directions<f32>) -> Result<Reading, Error> {
        let cosine = cosine(at, self.footprint.arm())?;
        self.calibration.scaled(counts, self.cosine / cosine)
    }
}
