//! Axis values of a machine with two arms.

use serde::{Deserialize, Serialize};

/// One value for each axis of a machine with two arms: a position in degrees, or a speed in degrees per second.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Axes {
    /// The light's polar angle, from the normal.
    pub theta_i: f64,
    /// The light's azimuth about the normal.
    pub phi_i: f64,
    /// The sensor's polar angle, from the normal.
    pub theta_o: f64,
    /// The sensor's azimuth about the normal.
    pub phi_o: f64,
}

impl Axes {
    /// The names of the axes, in the order of [`to_array`](Self::to_array).
    pub const NAMES: [&'static str; 4] = ["theta_i", "phi_i", "theta_o", "phi_o"];

    /// Creates axis values in the order theta_i, phi_i, theta_o, phi_o.
    #[must_use]
    pub fn from_array([theta_i, phi_i, theta_o, phi_o]: [f64; 4]) -> Self {
        Self {
            theta_i,
            phi_i,
            theta_o,
            phi_o,
        }
    }

    /// Returns the values in the order theta_i, phi_i, theta_o, phi_o.
    #[must_use]
    pub fn to_array(&self) -> [f64; 4] {
        [self.theta_i, self.phi_i, self.theta_o, self.phi_o]
    }

    /// Returns the values with light and sensor exchanged.
    #[must_use]
    pub fn swapped(&self) -> Self {
        Self {
            theta_i: self.theta_o,
            phi_i: self.phi_o,
            theta_o: self.theta_i,
            phi_o: self.phi_i,
        }
    }
}

/// Wraps an angle into the range \[-180, 180\] degrees. An angle within that range is unchanged.
pub(super) fn wrapped(degrees: f64) -> f64 {
    match (-180.0..=180.0).contains(&degrees) {
        true => degrees,
        false => degrees - 360.0 * (degrees / 360.0).round(),
    }
}
