//! Spherical angles of one direction, and of two arms.

use serde::{Deserialize, Serialize};

use super::Directions;
use crate::numeric::math;

/// Spherical angles of a direction or an arm, in radians.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Spherical {
    /// Polar angle from the normal; 0 to pi/2 above the horizon. It may be negative: (-theta, phi) is (theta, phi +
    /// pi), for an arm that swings through the normal.
    pub theta: f32,
    /// Azimuth about the normal, from x towards y, with any number of turns.
    pub phi: f32,
}

impl Spherical {
    /// The unit vector.
    #[must_use]
    pub fn direction(&self) -> [f32; 3] {
        let (sin_theta, cos_theta) = math::sin_cos(self.theta);
        let (sin_phi, cos_phi) = math::sin_cos(self.phi);
        [sin_theta * cos_phi, sin_theta * sin_phi, cos_theta]
    }

    /// The angles of a vector of any length: theta in \[0, pi\], phi in \[-pi, pi\]. phi is 0 along the normal, where
    /// the azimuth is undefined. NaN for a NaN coordinate.
    #[must_use]
    pub fn from_direction([x, y, z]: [f32; 3]) -> Self {
        Self {
            theta: math::atan2(math::sqrt(x * x + y * y), z),
            phi: math::atan2(y, x),
        }
    }
}

/// The angles of both arms.
///
/// ```
/// use glimpse_core::geometry::{ArmAngles, Spherical};
///
/// let arms = ArmAngles {
///     incoming: Spherical { theta: 0.5, phi: 0.0 },
///     outgoing: Spherical { theta: 0.5, phi: 3.0 },
/// };
/// let directions = arms.directions();
/// assert!(directions.check().is_ok());
/// // The conversion is reversible.
/// let same = ArmAngles::from_directions(&directions);
/// assert!((same.outgoing.phi - 3.0).abs() < 1e-6);
/// // Turning both arms together keeps the angle between them.
/// let turned = arms.turned(1.0).directions();
/// assert!((directions.separation() - turned.separation()).abs() < 1e-5);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ArmAngles {
    /// The light's arm.
    pub incoming: Spherical,
    /// The sensor's arm.
    pub outgoing: Spherical,
}

impl ArmAngles {
    /// The pair of unit directions.
    #[must_use]
    pub fn directions(&self) -> Directions<f32> {
        Directions {
            incoming: self.incoming.direction(),
            outgoing: self.outgoing.direction(),
        }
    }

    /// The angles of a pair; see [`Spherical::from_direction`].
    #[must_use]
    pub fn from_directions(directions: &Directions<f32>) -> Self {
        Self {
            incoming: Spherical::from_direction(directions.incoming),
            outgoing: Spherical::from_direction(directions.outgoing),
        }
    }

    /// Both azimuths turned by `angle` radians about the normal. The BRDF of an isotropic sample stays the same.
    #[must_use]
    pub fn turned(&self, angle: f32) -> Self {
        let turned = |arm: Spherical| Spherical {
            phi: arm.phi + angle,
            ..arm
        };
        Self {
            incoming: turned(self.incoming),
            outgoing: turned(self.outgoing),
        }
    }
}
