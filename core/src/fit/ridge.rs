//! The Linear model: a ridge solve on a basis that is reduced to the sampled directions.
//!
//! Nielsen, Jensen, Ramamoorthi: On Optimal, Minimal BRDF Sampling for Reflectance Acquisition
//! (2015). A BRDF is mapped by [`map`](crate::model::linear::map), and what was mapped is a mean plus m principal components
//! times coefficients c. At n directions, with the components' values there as the rows of the
//! n x m matrix A and t = mapped measurement - mean,
//!
//! ```text
//! c = argmin |A c - t|^2 + sum over k of p_k c_k^2 = (A'A + P)^-1 A't,   P = diag(p)
//! ```
//!
//! for each color channel. The paper has p_k = eta for all k (its equation 7); a precision for
//! each component is a Gaussian prior on its coefficient.
//!
//! # The solve
//!
//! With u = t - A c the same c comes from (A P^-1 A' + I) u = t, c = P^-1 A'u. A [`Problem`] takes
//! whichever system has the smaller order, r = min(n, m), and factorizes it ([`Factors`]) as
//! L D L' in a buffer of the caller's. The factors depend on neither channel nor material: one
//! factorization, then two triangular solves for each right side. It cannot fail: its pivots have
//! lower bounds which rounding may not cross.
//!
//! In f32 that alone may be off by a hundredth where A'A + P is ill-conditioned. So each solve is
//! followed by iterative refinement, its residual in twice the working precision (error-free
//! products from plain f32 operations; no f64): one step where the system is small, at most
//! [`Real::REFINEMENTS`]. The largest error |c - c of f64| / |c of f64|, as `tests/suite/linear`
//! measures it over n from 1 to 512, m from 1 to 240 and precisions from 1 to 1e4:
//!
//! | refinements | n = 8, m = 5 | n = 64, m = 60 | n = 512, m = 240 |
//! |---|---|---|---|
//! | none | 2e-6 | 6e-4 | 2e-2 |
//! | 1 | 4e-8 | 6e-7 | 3e-4 |
//! | as many as it takes | 4e-8 | 4e-8 | 2e-7 |
//!
//! On a Cortex-M4F (QEMU, `-icount shift=0`) with n = 8 and m = 5 the factorization takes 3,600
//! instructions and the solves of three channels 14,000; with m = 60 they take 21,000 and 187,000.
//!
//! # Memory
//!
//! [`factor_length`] and [`scratch_length`] numbers, as constants. The basis is read in place, from
//! flash if need be: packed little-endian f32, aligned or not (see [`Stored`]).
//!
//! # Outside of the promise
//!
//! [`Linear`](super::Linear) and a [`Scan`](crate::scan::Scan) are what firmware calls. The solve
//! itself, and its adjoint above all, is public for the trainer, which differentiates through it, and
//! may change in any version.

mod error;
mod ldl;
mod pair;
mod problem;
mod solve;

pub use error::{Part, RidgeError};
pub use problem::{Problem, factor_length, scratch_length};
pub use solve::{Factors, RidgeGradient};

use crate::numeric::Scalar;

/// A single real number that ridge problems are solved in.
pub trait Real: Scalar<Parameter = Self, Sum = Self> + PartialOrd {
    /// 2^s + 1, s being half the digits of the significand, rounded up: it splits a number in two
    /// halves whose products are exact.
    const SPLITTER: f64;
    /// Steps of iterative refinement after each solve, at most.
    const REFINEMENTS: usize;
}

impl Real for f32 {
    const SPLITTER: f64 = 4_097.0;
    const REFINEMENTS: usize = 3;
}

#[cfg(feature = "libm")]
impl Real for f64 {
    const SPLITTER: f64 = 134_217_729.0;
    const REFINEMENTS: usize = 0;
}

/// The encoding of an entry of basis or precision.
pub trait Stored<S>: Copy {
    /// The entry as a number.
    fn value(self) -> S;
}

impl<S: Real> Stored<S> for S {
    #[inline(always)]
    fn value(self) -> S {
        self
    }
}

/// Packed little-endian f32, as recipes hold them.
impl Stored<f32> for [u8; 4] {
    #[inline(always)]
    fn value(self) -> f32 {
        f32::from_le_bytes(self)
    }
}

/// A row of A times a vector of m.
pub(super) fn dot<S: Real, T: Stored<S>>(row: &[T], vector: &[S]) -> S {
    let products = row.iter().zip(vector);
    products.fold(S::constant(0.0), |sum, (a, x)| {
        sum.plus_product(a.value(), *x)
    })
}

/// False for a NaN and an infinity, too.
fn is_positive<S: Real>(value: S) -> bool {
    value > S::constant(0.0) && value < S::constant(f64::MAX)
}
