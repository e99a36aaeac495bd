//! Smooth fields: factors that augment a material and vary slowly with the directions. A field may, for example,
//! brighten grazing angles or large theta_h.

use glimpse_core::geometry::HalfDifference;
use glimpse_core::numeric::Scalar;

/// The number of terms of a smooth field.
pub const FIELD_TERMS: usize = 5;

/// Returns the terms of a smooth field. Each is invariant under exchange of light and sensor, so a BRDF times the
/// exponential of their weighted sum is reciprocal.
#[must_use]
pub fn field_terms<S: Scalar>(direction: &HalfDifference<S>) -> [S; FIELD_TERMS] {
    let one = S::constant(1.0);
    let grazing = one - direction.dz;
    let squared = grazing * grazing;
    let tilt = one - direction.hz * direction.hz;
    [
        grazing + grazing,
        squared * squared * S::constant(4.0),
        tilt + tilt,
        (direction.dx * direction.dx - direction.dy * direction.dy) * tilt * S::constant(2.0),
        tilt * grazing * S::constant(3.0),
    ]
}
