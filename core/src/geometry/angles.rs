//! Rusinkiewicz angles.

use serde::{Deserialize, Serialize};

/// Rusinkiewicz angles in radians. `theta_h` and `theta_d` are in \[0, pi/2\]. Reciprocal BRDFs have period pi in
/// `phi_d`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Angles<T> {
    /// Angle between the normal and the half vector.
    pub theta_h: T,
    /// Angle between the half vector and the incoming direction.
    pub theta_d: T,
    /// Azimuth of the incoming direction about the half vector.
    pub phi_d: T,
}

impl<T: Copy> Angles<T> {
    /// Creates angles in the order theta_h, theta_d, phi_d.
    #[must_use]
    pub const fn from_array([theta_h, theta_d, phi_d]: [T; 3]) -> Self {
        Self {
            theta_h,
            theta_d,
            phi_d,
        }
    }

    /// Returns the angles in the order theta_h, theta_d, phi_d.
    #[must_use]
    pub const fn to_array(self) -> [T; 3] {
        [self.theta_h, self.theta_d, self.phi_d]
    }

    /// Converts each angle.
    #[must_use]
    pub fn map<U: Copy>(self, convert: impl FnMut(T) -> U) -> Angles<U> {
        Angles::from_array(self.to_array().map(convert))
    }
}
