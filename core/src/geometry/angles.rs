//! Rusinkiewicz angles.

/// Rusinkiewicz angles in radians. `theta_h` and `theta_d` are in \[0, pi/2\]. Reciprocal BRDFs have period pi in
/// `phi_d`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
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
    /// Unpacks theta_h, theta_d and phi_d from little-endian bytes.
    pub(crate) fn from_le_bytes(packed: &[u8; 12]) -> Self {
        let [a, b, c, d, e, f, g, h, i, j, k, l] = *packed;
        Self {
            theta_h: f32::from_le_bytes([a, b, c, d]),
            theta_d: f32::from_le_bytes([e, f, g, h]),
            phi_d: f32::from_le_bytes([i, j, k, l]),
        }
    }
}
