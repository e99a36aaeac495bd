//! The reach of a machine's arms.

use core::f32::consts::{FRAC_PI_2, PI};

use serde::{Deserialize, Serialize};

use super::decimal::Decimal;
use crate::geometry::{ArmAngles, Directions, DirectionsError};

/// The reach of a machine's arms, without limits of the azimuths; angles in radians. [`Limits::validate`] checks them;
/// deserialized ones are valid.
///
/// ```
/// use glimpse_core::geometry::{ArmAngles, Spherical};
/// use glimpse_core::gonio::{Limits, Unreachable};
///
/// let limits = Limits {
///     max_theta_o: 1.2,
///     min_separation: 0.2, // the lamp would shade the sample, or the arms collide
///     ..Limits::NONE
/// };
/// limits.validate()?;
///
/// let sensor_at = |theta| ArmAngles {
///     incoming: Spherical { theta: 0.5, phi: 0.0 },
///     outgoing: Spherical { theta, phi: 0.0 },
/// };
/// assert_eq!(limits.check(&sensor_at(0.9).directions()), Ok(()));
/// let error = limits.check(&sensor_at(0.6).directions()).unwrap_err();
/// assert!(matches!(error, Unreachable::Separation { by } if (by - 0.1).abs() < 1e-5));
/// # Ok::<(), glimpse_core::gonio::LimitsError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[serde(try_from = "UncheckedLimits")]
pub struct Limits {
    /// The largest polar angle of the light's arm: above 0, at most pi/2.
    pub max_theta_i: f32,
    /// The largest polar angle of the sensor's arm: above 0, at most pi/2.
    pub max_theta_o: f32,
    /// The smallest angle between light and sensor: 0 to pi, and at most the sum of the largest polar angles.
    pub min_separation: f32,
    /// True if light, normal and sensor always lie in one plane.
    pub in_plane: bool,
}

/// Limits as decoded, before [`Limits::validate`].
#[derive(Deserialize)]
pub(crate) struct UncheckedLimits {
    max_theta_i: f32,
    max_theta_o: f32,
    min_separation: f32,
    in_plane: bool,
}

impl TryFrom<UncheckedLimits> for Limits {
    type Error = LimitsError;

    fn try_from(unchecked: UncheckedLimits) -> Result<Self, LimitsError> {
        let limits = Self {
            max_theta_i: unchecked.max_theta_i,
            max_theta_o: unchecked.max_theta_o,
            min_separation: unchecked.min_separation,
            in_plane: unchecked.in_plane,
        };
        limits.validate()?;
        Ok(limits)
    }
}

impl Default for Limits {
    fn default() -> Self {
        Self::NONE
    }
}

impl Limits {
    /// No limits: both arms reach the whole hemisphere.
    pub const NONE: Self = Self {
        max_theta_i: FRAC_PI_2,
        max_theta_o: FRAC_PI_2,
        min_separation: 0.0,
        in_plane: false,
    };

    /// The tolerance of the limits of angles in radians (0.006 degrees). It covers the rounding of directions whose
    /// angles lie exactly on a limit.
    pub const TOLERANCE: f32 = 1e-4;
    /// The tolerance of `in_plane`, radians (0.06 degrees).
    pub const IN_PLANE_TOLERANCE: f32 = 1e-3;

    /// Checks the ranges of the limits.
    ///
    /// # Errors
    /// [`LimitsError`] with the field that is out of range, or [`LimitsError::NoDirections`].
    pub fn validate(&self) -> Result<(), LimitsError> {
        // This form of the condition rejects NaN too.
        let polar = |theta: f32| theta > 0.0 && theta <= FRAC_PI_2;
        if !polar(self.max_theta_i) {
            return Err(LimitsError::MaxThetaI);
        }
        if !polar(self.max_theta_o) {
            return Err(LimitsError::MaxThetaO);
        }
        if !(0.0..=PI).contains(&self.min_separation) {
            return Err(LimitsError::MinSeparation);
        }
        if self.min_separation > self.max_theta_i + self.max_theta_o {
            return Err(LimitsError::NoDirections);
        }
        Ok(())
    }

    /// Checks that the arms reach a pair of directions. A limit that is NaN is exceeded.
    ///
    /// # Errors
    /// [`Unreachable`] with the first limit that is exceeded and the excess, or with the error of the directions.
    pub fn check(&self, directions: &Directions<f32>) -> Result<(), Unreachable> {
        directions.check().map_err(Unreachable::Directions)?;
        let arms = ArmAngles::from_directions(directions);
        let by = arms.incoming.theta - self.max_theta_i;
        if exceeds(by, Self::TOLERANCE) {
            return Err(Unreachable::ThetaI { by });
        }
        let by = arms.outgoing.theta - self.max_theta_o;
        if exceeds(by, Self::TOLERANCE) {
            return Err(Unreachable::ThetaO { by });
        }
        let by = self.min_separation - directions.separation();
        if exceeds(by, Self::TOLERANCE) {
            return Err(Unreachable::Separation { by });
        }
        let by = directions.out_of_plane();
        if self.in_plane && exceeds(by, Self::IN_PLANE_TOLERANCE) {
            return Err(Unreachable::OutOfPlane { by });
        }
        Ok(())
    }
}

/// Returns true if an excess is larger than a tolerance, or NaN.
fn exceeds(by: f32, tolerance: f32) -> bool {
    by.is_nan() || by > tolerance
}

/// A reason why [`Limits`] are invalid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum LimitsError {
    /// `max_theta_i` is not in its range.
    MaxThetaI,
    /// `max_theta_o` is not in its range.
    MaxThetaO,
    /// `min_separation` is not in its range.
    MinSeparation,
    /// `min_separation` exceeds the sum of `max_theta_i` and `max_theta_o`, so that nothing is within reach.
    NoDirections,
}

impl core::fmt::Display for LimitsError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::MaxThetaI => "the limit `max_theta_i` is not above 0 and at most pi/2 (radians)",
            Self::MaxThetaO => "the limit `max_theta_o` is not above 0 and at most pi/2 (radians)",
            Self::MinSeparation => "the limit `min_separation` is not from 0 to pi (radians)",
            Self::NoDirections => {
                "nothing is within the limits: `min_separation` exceeds the sum of `max_theta_i` and `max_theta_o`"
            }
        })
    }
}

impl core::error::Error for LimitsError {}

/// A reason why a pair of directions is out of reach.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Unreachable {
    /// The directions have no BRDF.
    Directions(DirectionsError),
    /// The light's polar angle is above `max_theta_i`.
    ThetaI {
        /// Excess, radians.
        by: f32,
    },
    /// The sensor's polar angle is above `max_theta_o`.
    ThetaO {
        /// Excess, radians.
        by: f32,
    },
    /// The angle between light and sensor is below `min_separation`.
    Separation {
        /// Excess, radians.
        by: f32,
    },
    /// Light, normal and sensor are not in one plane.
    OutOfPlane {
        /// Excess, radians.
        by: f32,
    },
    /// The machine lacks an axis that the move needs.
    MissingAxis,
}

impl core::fmt::Display for Unreachable {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let degrees = |radians: &f32| Decimal(radians.to_degrees());
        match self {
            Self::Directions(error) => error.fmt(f),
            Self::ThetaI { by } => write!(
                f,
                "the light's polar angle is {} degrees above the limit `max_theta_i`",
                degrees(by)
            ),
            Self::ThetaO { by } => write!(
                f,
                "the sensor's polar angle is {} degrees above the limit `max_theta_o`",
                degrees(by)
            ),
            Self::Separation { by } => write!(
                f,
                "light and sensor are {} degrees closer than the limit `min_separation`",
                degrees(by)
            ),
            Self::OutOfPlane { by } => write!(
                f,
                "light, normal and sensor are {} degrees out of one plane, but the limit `in_plane` is set",
                degrees(by)
            ),
            Self::MissingAxis => {
                f.write_str("the directions need an axis that the machine lacks: its speed is 0")
            }
        }
    }
}

impl core::error::Error for Unreachable {}
