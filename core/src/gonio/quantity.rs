//! The BRDF, and quantities that are mistaken for it.

use core::f32::consts::PI;

use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::geometry::{Arm, Directions};

/// The quantity of a reflectance measurement.
///
/// Scans need the BRDF. A fit cannot detect another quantity, because it explains the values equally well, or even
/// better. [`gonio::tile`](super::tile) detects it.
///
/// ```
/// use glimpse_core::geometry::Directions;
/// use glimpse_core::gonio::Quantity;
///
/// let at = Directions { incoming: [0.6, 0.0, 0.8], outgoing: [0.0, 0.0, 1.0] };
/// let read = [0.24, 0.16, 0.08]; // the lamp lights all that the sensor sees
/// let brdf = Quantity::BrdfTimesCosThetaI.to_brdf(read, &at)?;
/// assert!((brdf[0] - 0.3).abs() < 1e-6);
/// # Ok::<(), glimpse_core::error::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Quantity {
    /// The BRDF, sr^-1: radiance per irradiance.
    Brdf,
    /// The BRDF times cos(theta_i), sr^-1: radiance under a lamp of intensity 1.
    BrdfTimesCosThetaI,
    /// The BRDF times cos(theta_o), sr^-1: intensity of a spot per flux that lights it. ASTM calls it the
    /// cosine-corrected BSDF.
    BrdfTimesCosThetaO,
    /// The reflectance factor (radiance factor), without unit: radiance relative to that of a white Lambertian surface
    /// of reflectance 1. It is pi times the BRDF.
    ReflectanceFactor,
}

impl Quantity {
    /// The positive factor that converts the BRDF to this quantity.
    ///
    /// # Errors
    /// [`ErrorCode::Directions`](crate::error::ErrorCode::Directions) with the arm whose cosine is needed but not above 0.
    fn factor(self, at: &Directions<f32>) -> Result<f32, Error> {
        match self {
            Self::Brdf => Ok(1.0),
            Self::BrdfTimesCosThetaI => cosine(at, Arm::Light),
            Self::BrdfTimesCosThetaO => cosine(at, Arm::Sensor),
            Self::ReflectanceFactor => Ok(PI),
        }
    }

    /// Converts `values` of this quantity at a pair of directions to the BRDF, sr^-1.
    ///
    /// # Errors
    /// [`ErrorCode::Directions`](crate::error::ErrorCode::Directions) with the arm whose cosine is needed but not above 0.
    pub fn to_brdf(self, values: [f32; 3], at: &Directions<f32>) -> Result<[f32; 3], Error> {
        let factor = self.factor(at)?;
        Ok(values.map(|value| value / factor))
    }

    /// Converts the BRDF `brdf`, sr^-1, at a pair of directions to this quantity.
    ///
    /// # Errors
    /// [`ErrorCode::Directions`](crate::error::ErrorCode::Directions) with the arm whose cosine is needed but not above 0.
    pub fn of_brdf(self, brdf: [f32; 3], at: &Directions<f32>) -> Result<[f32; 3], Error> {
        let factor = self.factor(at)?;
        Ok(brdf.map(|value| value * factor))
    }
}

impl core::fmt::Display for Quantity {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Brdf => "BRDF",
            Self::BrdfTimesCosThetaI => "BRDF times cos(theta_i)",
            Self::BrdfTimesCosThetaO => "BRDF times cos(theta_o)",
            Self::ReflectanceFactor => "reflectance factor",
        })
    }
}

/// Returns the cosine of an arm's polar angle, which has to be above 0.
pub(super) fn cosine(at: &Directions<f32>, arm: Arm) -> Result<f32, Error> {
    let [_, _, cosine] = match arm {
        Arm::Light => at.incoming,
        Arm::Sensor => at.outgoing,
    };
    // This form of the condition rejects NaN too.
    if cosine > 0.0 && cosine.is_finite() {
        Ok(cosine)
    } else {
        Err(arm.error())
    }
}
