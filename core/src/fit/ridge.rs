//! The ridge solve of the estimator, and its adjoint.
//!
//! Q has a row of K components for each of n readings, s_i is the root of the weight of reading i (0 if it is missing),
//! and p are the precisions of a Gaussian prior. With S = diag(s) and P = diag(p), the solve is
//!
//! ```text
//! z = argmin |S (t - Q z)|^2 + sum over k of p_k z_k^2 = (Q'S^2 Q + P)^-1 Q'S^2 t
//! ```
//!
//! That is the paper's equation 7, for which all p_k are eta and all s_i are 1. Equivalently, z = P^-1 Q'S u with
//! (S Q P^-1 Q'S + I) u = S t. A [`System`] uses the smaller of the two, of order r = min(n, K), and factorizes it as
//! L D L' in a packed triangle. The factors do not depend on t. The factorization cannot fail: its pivots are clamped to
//! their exact lower bounds, p_k or 1.
//!
//! In f32 the relative error may reach 0.01 if the system is ill-conditioned. Two steps of iterative refinement with the
//! residual t - Q z, which is computed from Q, reduce it: the method of corrected seminormal equations (Björck 1987).
//! `suite/ridge.rs` measures it.

use super::ldl::{factorize_row, packed_length, solve};
use crate::numeric::{Real, Rows, Stored};

/// Returns r = min(n, K), the order of the system.
pub(crate) const fn order(readings: usize, components: usize) -> usize {
    if readings < components {
        readings
    } else {
        components
    }
}

/// Returns the number of entries of the factors: r (r + 1) / 2.
#[must_use]
pub const fn factor_length(readings: usize, components: usize) -> usize {
    packed_length(order(readings, components))
}

/// Returns the scratch memory of a solve, in numbers: 2 r. A factorization and an adjoint take K.
#[must_use]
pub const fn scratch_length(readings: usize, components: usize) -> usize {
    2 * order(readings, components)
}

/// A ridge system without a right-hand side.
#[derive(Clone, Copy, Debug)]
pub struct System<'a, S, T, Q> {
    /// Q.
    pub rows: Q,
    /// s, n.
    pub scales: &'a [S],
    /// p, K.
    pub precision: &'a [T],
}

/// The derivatives of a loss. [`System::adjoint`] adds to them.
#[derive(Debug)]
pub struct RidgeGradient<'g, S> {
    /// With respect to t, n.
    pub targets: &'g mut [S],
    /// With respect to Q, n rows of K.
    pub rows: &'g mut [S],
    /// With respect to p, K.
    pub precision: &'g mut [S],
}

impl<S: Real, T: Stored<S>, Q: Rows<S>> System<'_, S, T, Q> {
    /// r, the order of the system.
    #[must_use]
    pub fn order(&self) -> usize {
        order(self.scales.len(), self.precision.len())
    }

    fn is_primal(&self) -> bool {
        self.precision.len() <= self.scales.len()
    }

    /// Assembles and factorizes a row of the system. The rows above must be factorized. `scratch` has K numbers.
    pub fn factorize_row(&self, index: usize, factors: &mut [S], scratch: &mut [S]) {
        let row = factors.get_mut(packed_length(index)..packed_length(index + 1));
        let row = row.unwrap_or_default();
        row.fill(S::constant(0.0));
        let mut min_pivot = S::constant(1.0);
        if self.is_primal() {
            for (reading, scale) in self.scales.iter().enumerate() {
                let entry = self.rows.entry(reading, index);
                self.rows.add(reading, *scale * *scale * entry, row);
            }
            if let Some(precision) = self.precision.get(index) {
                min_pivot = precision.value();
            }
        } else {
            scratch.fill(S::constant(0.0));
            if let Some(scale) = self.scales.get(index) {
                self.rows.add(index, *scale, scratch);
            }
            self.divide(scratch);
            for ((reading, scale), entry) in self.scales.iter().enumerate().zip(&mut *row) {
                *entry = *scale * self.rows.dot(reading, scratch);
            }
        }
        factorize_row(factors, index, min_pivot);
    }

    /// Divides by the precisions.
    fn divide(&self, list: &mut [S]) {
        for (entry, precision) in list.iter_mut().zip(self.precision) {
            *entry = *entry / precision.value();
        }
    }

    /// Computes z. `scratch` has [`scratch_length`] numbers.
    pub fn solve(&self, factors: &[S], targets: &[S], z: &mut [S], scratch: &mut [S]) {
        self.run(factors, targets, None, z, scratch);
    }

    /// Computes x = (Q'S^2 Q + P)^-1 (lambda + Q'S^2 t). A lambda of None is 0, and targets after the end are 0.
    fn run(
        &self,
        factors: &[S],
        targets: &[S],
        lambda: Option<&[S]>,
        x: &mut [S],
        scratch: &mut [S],
    ) {
        let Some((residual, rest)) = scratch.split_at_mut_checked(self.order()) else {
            return;
        };
        let zero = S::constant(0.0);
        let target = |reading: usize| targets.get(reading).copied().unwrap_or(zero);
        if self.is_primal() {
            x.fill(zero);
            for _ in 0..=S::REFINEMENTS {
                // lambda - P x + Q'S^2 (t - Q x)
                initialize(residual, lambda);
                for ((entry, precision), x) in residual.iter_mut().zip(self.precision).zip(&*x) {
                    *entry = *entry - precision.value() * *x;
                }
                for (reading, scale) in self.scales.iter().enumerate() {
                    let rest = target(reading) - self.rows.dot(reading, x);
                    self.rows.add(reading, *scale * *scale * rest, residual);
                }
                solve(factors, residual);
                add(x, residual);
            }
            return;
        }
        let u = rest.get_mut(..self.order()).unwrap_or_default();
        u.fill(zero);
        for _ in 0..=S::REFINEMENTS {
            self.recover(u, lambda, x);
            // S t - u - S Q x
            for ((reading, scale), (entry, u)) in self
                .scales
                .iter()
                .enumerate()
                .zip(residual.iter_mut().zip(&*u))
            {
                *entry = *scale * (target(reading) - self.rows.dot(reading, x)) - *u;
            }
            solve(factors, residual);
            add(u, residual);
        }
        self.recover(u, lambda, x);
    }

    /// Computes x = P^-1 (lambda + Q'S u).
    fn recover(&self, u: &[S], lambda: Option<&[S]>, x: &mut [S]) {
        initialize(x, lambda);
        for ((reading, scale), u) in self.scales.iter().enumerate().zip(u) {
            self.rows.add(reading, *scale * *u, x);
        }
        self.divide(x);
    }

    /// Adds the derivatives of a loss to `gradient`, given `lambda`, those with respect to z.
    ///
    /// `z` is the result of [`System::solve`] for `targets`. With x = (Q'S^2 Q + P)^-1 lambda, the derivatives are
    /// S^2 Q x with respect to t, s_i^2 ((t - Q z)_i x_k - (Q x)_i z_k) with respect to Q_ik, and -x_k z_k with respect
    /// to p_k. `scratch` has K + [`scratch_length`] numbers.
    pub fn adjoint(
        &self,
        factors: &[S],
        (targets, z): (&[S], &[S]),
        lambda: &[S],
        gradient: &mut RidgeGradient<'_, S>,
        scratch: &mut [S],
    ) {
        let components = self.precision.len();
        let Some((x, scratch)) = scratch.split_at_mut_checked(components) else {
            return;
        };
        self.run(factors, &[], Some(lambda), x, scratch);
        let by_rows = gradient.rows.chunks_exact_mut(components.max(1));
        let readings = self.scales.iter().zip(targets).enumerate();
        for (((reading, (scale, target)), by_target), by_row) in
            readings.zip(&mut *gradient.targets).zip(by_rows)
        {
            let weight = *scale * *scale;
            let projection = weight * self.rows.dot(reading, x);
            let rest = weight * (*target - self.rows.dot(reading, z));
            *by_target = *by_target + projection;
            for ((by_entry, x), z) in by_row.iter_mut().zip(&*x).zip(z) {
                *by_entry = *by_entry + rest * *x - projection * *z;
            }
        }
        let entries = gradient.precision.iter_mut().zip(&*x).zip(z);
        for ((by_precision, x), z) in entries {
            *by_precision = *by_precision - *x * *z;
        }
    }
}

/// Initializes a sum with lambda, or with 0.
fn initialize<S: Real>(sum: &mut [S], lambda: Option<&[S]>) {
    sum.fill(S::constant(0.0));
    add(sum, lambda.unwrap_or_default());
}

/// Adds a list to another one.
fn add<S: Real>(sum: &mut [S], list: &[S]) {
    for (entry, value) in sum.iter_mut().zip(list) {
        *entry = *entry + *value;
    }
}
