//! One number for each axis of a machine.

/// One number for each axis of a machine with two arms: where they stand, in degrees, or how fast
/// they turn, in degrees per second.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
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
    /// What they are called, in the order of [`values`](Self::values).
    pub const NAMES: [&'static str; 4] = ["theta_i", "phi_i", "theta_o", "phi_o"];

    /// From four numbers in the order theta_i, phi_i, theta_o, phi_o.
    #[must_use]
    pub fn of([theta_i, phi_i, theta_o, phi_o]: [f64; 4]) -> Self {
        Self {
            theta_i,
            phi_i,
            theta_o,
            phi_o,
        }
    }

    /// The four numbers in the order theta_i, phi_i, theta_o, phi_o.
    #[must_use]
    pub fn values(&self) -> [f64; 4] {
        [self.theta_i, self.phi_i, self.theta_o, self.phi_o]
    }

    /// Light and sensor exchanged.
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

/// The same angle within -180 to 180 degrees; one that is there already is left as it is.
pub(super) fn wrapped(degrees: f64) -> f64 {
    match (-180.0..=180.0).contains(&degrees) {
        true => degrees,
        false => degrees - 360.0 * (degrees / 360.0).round(),
    }
}
