//! Smooth fields: factors over directions that augment a material, such as brighter grazing angles or steeper slopes.

use glimpse_core::geometry::HalfDifference;
use glimpse_core::numeric::Scalar;

/// The number of terms of a smooth field.
pub const FIELD_TERMS: usize = 5;

/// Returns the terms of a smooth field. Each is invariant under exchange of light and sensor, so a BRDF times the
/// exponential of their weighted sum is reciprocal.
#[must_use]
pub fn field_terms<S: Scalar>(at: &HalfDifference<S>) -> [S; FIELD_TERMS] {
    let one = S::constant(1.0);
    let grazing = one - at.dz;
    let squared = grazing * grazing;
    let tilt = one - at.hz * at.hz;
    [
        grazing + grazing,
        squared * squared * S::constant(4.0),
        tilt + tilt,
        (at.dx * at.dx - at.dy * at.dy) * tilt * S::constant(2.0),
        tilt * grazing * S::constant(3.0),
    ]
}
