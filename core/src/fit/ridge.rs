//! The model Linear: a ridge solve with a basis that is reduced to the sampled directions.
//!
//! Nielsen, Jensen, Ramamoorthi: On Optimal, Minimal BRDF Sampling for Reflectance Acquisition (2015). A BRDF is mapped
//! by [`map`](crate::model::linear::map). The mapped BRDF is a mean plus m principal components times coefficients c.
//! The rows of the n x m matrix A are the components' values at n directions, and t = mapped measurement - mean. Then
//!
//! ```text
//! c = argmin |A c - t|^2 + sum over k of p_k c_k^2 = (A'A + P)^-1 A't,   P = diag(p)
//! ```
//!
//! for each color channel. The paper has p_k = eta for all k (its equation 7). The precision p_k is a Gaussian prior on
//! the coefficient c_k.
//!
//! # The solve
//!
//! Equivalently, the residual u = t - A c solves (A P^-1 A' + I) u = t, and c = P^-1 A'u. A [`Problem`] uses the
//! smaller of the two systems, of order r = min(n, m), and factorizes it ([`Factors`]) as L D L' in the caller's
//! buffer. The factors depend on neither channel nor material, so one factorization serves all right-hand sides. Each
//! right-hand side takes two triangular solves. The factorization cannot fail, because its pivots are clamped to their
//! exact lower bounds.
//!
//! In f32, the relative error of the result may reach 0.01 if A'A + P is ill-conditioned. Therefore each solve ends
//! with iterative refinement: one step for a small system, otherwise up to [`Real::REFINEMENTS`] steps. A step computes
//! the residual in twice the working precision (error-free products from plain f32 operations; no f64).
//! `tests/suite/linear` measures the largest relative errors |c - c of f64| / |c of f64|, for n from 1 to 512, m from 1
//! to 240 and precisions from 1 to 1e4:
//!
//! | refinements | n = 8, m = 5 | n = 64, m = 60 | n = 512, m = 240 |
//! |---|---|---|---|
//! | none | 2e-6 | 6e-4 | 2e-2 |
//! | 1 | 4e-8 | 6e-7 | 3e-4 |
//! | until convergence | 4e-8 | 4e-8 | 2e-7 |
//!
//! On a Cortex-M4F (QEMU, `-icount shift=0`) with n = 8 and m = 5, the factorization takes 3,600 instructions and the
//! solves of three channels 14,000. With m = 60 they take 21,000 and 187,000.
//!
//! # Memory
//!
//! A solve takes [`factor_length`] and [`scratch_length`] numbers, which are constants. The basis is read in place, for
//! example from flash: packed little-endian f32, aligned or not (see [`Stored`]).
//!
//! # Stability
//!
//! Firmware uses [`Linear`](super::Linear) with a [`Scan`](crate::scan::Scan). The solve and its adjoint are public for
//! the trainer, which differentiates through the solve. They may change in any version.

mod error;
mod ldl;
mod pair;
mod problem;
mod solve;

pub use error::{Part, RidgeError};
pub use problem::{Problem, factor_length, scratch_length};
pub use solve::{Factors, RidgeGradient};
pub use ldl::{add_outer_product, factorize_row_with, packed_length, solve as solve_factorized};

use crate::numeric::Scalar;

/// The type of a real number in ridge problems: f32 or f64.
pub trait Real: Scalar<Parameter = Self, Sum = Self> + PartialOrd {
    /// 2^s + 1, where s is half the number of the significand's binary digits, rounded up. Veltkamp's splitting uses it
    /// to split a number into two halves whose products are exact.
    const SPLITTER: f64;
    /// The largest number of refinement steps after each solve.
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

/// The encoding of an entry of the basis or the precisions.
pub trait Stored<S>: Copy {
    /// Returns the entry as a number.
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

/// Returns the dot product of a row of A and a vector of length m.
pub(super) fn dot<S: Real, T: Stored<S>>(row: &[T], vector: &[S]) -> S {
    let products = row.iter().zip(vector);
    products.fold(S::constant(0.0), |sum, (a, x)| {
        sum.plus_product(a.value(), *x)
    })
}

/// Returns true if a number is positive and finite, and not NaN.
fn is_positive<S: Real>(value: S) -> bool {
    value > S::constant(0.0) && value < S::constant(f64::MAX)
}
