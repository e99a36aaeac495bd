//! The mapping of the model Linear: logarithms of the BRDF times both cosines.
//!
//! Nielsen, Jensen, Ramamoorthi: On Optimal, Minimal BRDF Sampling for Reflectance Acquisition (2015).

use crate::numeric::Scalar;

/// The offset e of the mapping. It is added to the BRDF times both cosines, so that dark values have a logarithm
/// (Nielsen et al. 2015).
pub const EPSILON: f64 = 1e-3;
/// The smallest weight that [`unmap`] divides by.
const MIN_WEIGHT: f64 = 1e-6;

/// ln((brdf w + e) / e).
///
/// The paper's mapping is ln((brdf w + e) / (median w + e)), with a median over materials: this minus the mapped median,
/// which is part of a recipe's `center`. `brdf` is in sr^-1, not times a cosine, and `weight` is w = cos(theta_i)
/// cos(theta_o).
#[inline(always)]
pub fn map<S: Scalar>(brdf: S, weight: S) -> S {
    let epsilon = S::constant(EPSILON);
    (epsilon.plus_product(brdf, weight) / epsilon).ln()
}

/// The inverse of [`map`]: max((e exp(mapped) - e) / w, 0), a BRDF in sr^-1, not times a cosine.
///
/// If w is below 1e-6, the divisor is 1e-6. The result is NaN if `mapped` is NaN or infinite.
#[inline(always)]
pub fn unmap<S: Scalar>(mapped: S, weight: S) -> S {
    let epsilon = S::constant(EPSILON);
    let min_weight = S::constant(MIN_WEIGHT);
    let scaled = epsilon * mapped.exp() - epsilon;
    let divisor = (weight - min_weight).if_positive(weight, min_weight);
    // The product is 0, or NaN: the relu of f32 returns 0 for a NaN whose sign bit is set, as that of x86.
    let zero = S::constant(0.0);
    (scaled / divisor).relu().plus_product(mapped, zero)
}
