//! The cosines between the directions and axes of a reflection.

use glimpse_core::geometry::HalfDifference;

/// The cosines that an isotropic, opaque BRDF without a preferred direction depends on, each above 0 to 1.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cosines {
    /// Between the light and the normal.
    pub(crate) light: f64,
    /// Between the sensor and the normal.
    pub(crate) sensor: f64,
    /// Between the half vector and the normal.
    pub(crate) half: f64,
    /// Between the light and the half vector.
    pub(crate) difference: f64,
}

impl Cosines {
    /// Cosines are at least this, so that all quotients are finite.
    const MIN: f64 = 1e-4;

    pub(crate) fn of(at: &HalfDifference<f32>) -> Self {
        let cosine = |value: f32| f64::from(value).clamp(Self::MIN, 1.0);
        Self {
            light: cosine(at.cos_theta_i()),
            sensor: cosine(at.cos_theta_o()),
            half: cosine(at.hz),
            difference: cosine(at.dz),
        }
    }
}
