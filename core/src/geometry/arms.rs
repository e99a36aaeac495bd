//! The axes of two arms.

use serde::{Deserialize, Serialize};

use super::Directions;
use crate::numeric::math;

/// A number for each axis of two arms: angles in radians, or speeds in radians per second.
///
/// ```
/// use glimpse_core::geometry::Arms;
///
/// let arms = Arms { theta_i: 0.5, theta_o: 0.5, phi_o: 3.0, ..Arms::NORMAL };
/// let directions = arms.directions();
/// assert!(directions.check().is_ok());
/// // The conversion is reversible.
/// let same = Arms::from_directions(&directions);
/// assert!((same.phi_o - 3.0).abs() < 1e-6);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Arms<T = f32> {
    /// The polar angle of the light's arm from the normal; 0 to pi/2 above the horizon. It may be negative: (-theta, phi)
    /// is (theta, phi + pi), for an arm that swings through the normal.
    pub theta_i: T,
    /// The azimuth of the light's arm about the normal, from x towards y, with any number of turns.
    pub phi_i: T,
    /// The polar angle of the sensor's arm.
    pub theta_o: T,
    /// The azimuth of the sensor's arm.
    pub phi_o: T,
}

impl<T: Copy> Arms<T> {
    /// Creates numbers for the axes in the order theta_i, phi_i, theta_o, phi_o.
    #[must_use]
    pub const fn from_array([theta_i, phi_i, theta_o, phi_o]: [T; 4]) -> Self {
        Self {
            theta_i,
            phi_i,
            theta_o,
            phi_o,
        }
    }

    /// Returns the numbers in the order theta_i, phi_i, theta_o, phi_o.
    #[must_use]
    pub const fn to_array(self) -> [T; 4] {
        [self.theta_i, self.phi_i, self.theta_o, self.phi_o]
    }

    /// Converts each number.
    #[must_use]
    pub fn map<U: Copy>(self, convert: impl FnMut(T) -> U) -> Arms<U> {
        Arms::from_array(self.to_array().map(convert))
    }
}

impl Arms {
    /// Both arms along the normal.
    pub const NORMAL: Self = Self::from_array([0.0; 4]);
    /// The names of the axes, in the order of [`to_array`](Self::to_array).
    pub const NAMES: [&'static str; 4] = ["theta_i", "phi_i", "theta_o", "phi_o"];

    /// The pair of unit directions.
    #[must_use]
    pub fn directions(&self) -> Directions<f32> {
        let direction = |theta, phi| {
            let (sin_theta, cos_theta) = math::sin_cos(theta);
            let (sin_phi, cos_phi) = math::sin_cos(phi);
            [sin_theta * cos_phi, sin_theta * sin_phi, cos_theta]
        };
        Directions {
            incoming: direction(self.theta_i, self.phi_i),
            outgoing: direction(self.theta_o, self.phi_o),
        }
    }

    /// The angles of a pair of vectors of any length: theta in \[0, pi\], phi in \[-pi, pi\]. phi is 0 along the normal,
    /// where the azimuth is undefined. NaN for a NaN coordinate.
    #[must_use]
    pub fn from_directions(directions: &Directions<f32>) -> Self {
        let angles = |[x, y, z]: [f32; 3]| {
            let theta = math::atan2(math::sqrt(x * x + y * y), z);
            (theta, math::atan2(y, x))
        };
        let (theta_i, phi_i) = angles(directions.incoming);
        let (theta_o, phi_o) = angles(directions.outgoing);
        Self::from_array([theta_i, phi_i, theta_o, phi_o])
    }
}
