//! Rusinkiewicz angles.

use serde::{Deserialize, Serialize};

/// Rusinkiewicz angles in radians. `theta_h` and `theta_d` are in \[0, pi/2\]. Reciprocal BRDFs have period pi in
/// `phi_d`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Angles<T> {
    /// Angle between the normal and the half vector.
    pub theta_h: T,
    /// Angle between the half vector and the incoming direction.
    pub theta_d: T,
    /// Azimuth of the incoming direction about the half vector.
    pub phi_d: T,
}

impl Angles<f32> {
    pub(crate) fn from_array([theta_h, theta_d, phi_d]: [f32; 3]) -> Self {
        Self {
            theta_h,
            theta_d,
            phi_d,
        }
    }
}
