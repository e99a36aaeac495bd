//! Parameterization of polar angles, for numbers and dual numbers.

use std::f64::consts::PI;

pub(super) use glimpse_kernels::dual::RealScalar;

/// Maps an angle theta in \[0, pi/2\] to u(theta) in \[0, 1\].
#[inline(always)]
pub(super) fn unit_theta<S: RealScalar>(theta: S) -> S {
    (theta.relu() * S::constant(2.0 / PI)).sqrt()
}
