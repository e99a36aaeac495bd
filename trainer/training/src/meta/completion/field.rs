//! Smooth factors that vary a material: its grazing angles brighter or darker, its slopes steeper.

use glimpse_core::geometry::HalfDifference;
use glimpse_core::numeric::Scalar;

/// How many functions a smooth field is made of.
pub const FIELD: usize = 5;

/// The functions that a smooth field is made of. Each is the same when light and sensor change places,
/// so that a BRDF times the field's exponential is reciprocal too.
#[must_use]
pub fn field_at<S: Scalar>(at: &HalfDifference<S>) -> [S; FIELD] {
    let one = S::constant(1.0);
    let grazing = one - at.dz;
    let squared = grazing * grazing;
    let lying = one - at.hz * at.hz;
    [
        grazing + grazing,
        squared * squared * S::constant(4.0),
        lying + lying,
        (at.dx * at.dx - at.dy * at.dy) * lying * S::constant(2.0),
        lying * grazing * S::constant(3.0),
    ]
}
