//! Lights of photographs.

/// A light far away.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// The unit vector toward it: x right, y up, z toward the camera.
    pub direction: [f64; 3],
    /// The intensity of each channel: a pixel divided by it is BRDF times cos(theta_i).
    pub intensity: [f64; 3],
}
