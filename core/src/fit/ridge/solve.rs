//! Solves of a factorized ridge problem with iterative refinement, and their adjoint.

use super::ldl::{self, packed_length};
use super::pair::Pair;
use super::problem::prefix;
use super::{Part, Problem, Real, RidgeError, Stored, dot, is_positive};

/// The size of a correction, relative to the corrected solution, that ends the refinement. The next correction would be
/// smaller by at least the same factor.
const TOLERANCE: f64 = 1e-5;

/// A factorized problem. It solves any number of right-hand sides, also from several threads at the same time.
#[derive(Clone, Copy, Debug)]
pub struct Factors<'a, 'b, T, S> {
    pub(super) problem: Problem<'a, T>,
    pub(super) packed: &'b [S],
}

/// The gradient of the loss. [`Factors::adjoint`] adds to it.
#[derive(Debug)]
pub struct RidgeGradient<'g, S> {
    /// With respect to the mapped measurements t (n). The gradient with respect to the mean is the negative of this.
    pub mapped: &'g mut [S],
    /// With respect to the basis A (n x m, row-major).
    pub basis: &'g mut [S],
    /// With respect to the precisions p (m).
    pub precision: &'g mut [S],
}

impl<'a, T> Problem<'a, T> {
    /// Factorizes the system into `factors`.
    ///
    /// `factors` has at least [`factor_length`](super::factor_length) entries, and `scratch` at least
    /// [`scratch_length`](super::scratch_length). The content of `scratch` is ignored, and meaningless after the call.
    ///
    /// # Errors
    /// [`RidgeError::Buffer`] if a buffer is too small, or [`RidgeError::Precision`] if a precision is not positive and
    /// finite.
    pub fn factorize<'b, S: Real>(
        self,
        factors: &'b mut [S],
        scratch: &mut [S],
    ) -> Result<Factors<'a, 'b, T, S>, RidgeError>
    where
        T: Stored<S>,
    {
        let order = self.order();
        let packed = prefix(factors, packed_length(order), Part::Factors)?;
        let scratch = self.scratch(scratch)?;
        let is_invalid = |p: &T| !is_positive(p.value());
        if let Some(index) = self.precision.iter().position(is_invalid) {
            return Err(RidgeError::Precision(index));
        }
        for index in 0..order {
            self.factorize_row(packed, index, scratch);
        }
        Ok(Factors {
            problem: self,
            packed,
        })
    }

    /// Returns the factors in a buffer, after [`Problem::factorize_row`] for all of its rows.
    pub(crate) fn factors<'b, S>(self, packed: &'b [S]) -> Factors<'a, 'b, T, S> {
        Factors {
            problem: self,
            packed,
        }
    }
}

impl<'a, T: Stored<S>, S: Real> Factors<'a, '_, T, S> {
    /// The factorized problem.
    #[must_use]
    pub fn problem(&self) -> &Problem<'a, T> {
        &self.problem
    }

    /// Computes c = (A'A + P)^-1 A't for one channel. t are the mapped measurements minus the mean.
    ///
    /// # Errors
    /// [`RidgeError::Length`] if the length of `mapped` is not n or that of `coefficients` not m,
    /// [`RidgeError::Buffer`] if `scratch` is too small.
    pub fn coefficients(
        &self,
        mapped: &[S],
        coefficients: &mut [S],
        scratch: &mut [S],
    ) -> Result<(), RidgeError> {
        check(mapped, self.problem.samples(), Part::Mapped)?;
        let components = self.problem.components();
        check(coefficients, components, Part::Coefficients)?;
        let scratch = self.problem.scratch(scratch)?;
        self.run(mapped.iter().copied(), None, coefficients, scratch);
        Ok(())
    }

    /// Computes (A'A + P)^-1 lambda, for any lambda of m entries.
    ///
    /// # Errors
    /// [`RidgeError::Length`] if the length of `lambda` or `solution` is not m, [`RidgeError::Buffer`] if `scratch` is
    /// too small.
    pub fn solve(
        &self,
        lambda: &[S],
        solution: &mut [S],
        scratch: &mut [S],
    ) -> Result<(), RidgeError> {
        let components = self.problem.components();
        check(lambda, components, Part::Coefficients)?;
        check(solution, components, Part::Coefficients)?;
        let scratch = self.problem.scratch(scratch)?;
        let zeros = core::iter::repeat_n(S::constant(0.0), self.problem.samples());
        self.run(zeros, Some(lambda), solution, scratch);
        Ok(())
    }

    /// Adds the gradient of a loss to `gradient`. `lambda` is its derivative with respect to the coefficients.
    ///
    /// `coefficients` is the result of [`Factors::coefficients`] for `mapped`. With s = (A'A + P)^-1 lambda, the
    /// derivatives are d/dt = A s, d/dA_jk = (t - A c)_j s_k - (A s)_j c_k and d/dp_k = -s_k c_k.
    ///
    /// # Errors
    /// [`RidgeError::Length`] if the length of a list is not n, m or n m as required, [`RidgeError::Buffer`] if
    /// `scratch` is too small. On an error nothing is added.
    pub fn adjoint(
        &self,
        mapped: &[S],
        coefficients: &[S],
        lambda: &[S],
        gradient: &mut RidgeGradient<'_, S>,
        scratch: &mut [S],
    ) -> Result<(), RidgeError> {
        let (samples, components) = (self.problem.samples(), self.problem.components());
        check(mapped, samples, Part::Mapped)?;
        check(coefficients, components, Part::Coefficients)?;
        check(lambda, components, Part::Coefficients)?;
        check(gradient.mapped, samples, Part::Mapped)?;
        check(gradient.basis, self.problem.basis.len(), Part::Basis)?;
        check(gradient.precision, components, Part::Precision)?;
        let scratch = self.problem.scratch(scratch)?;
        let Some((solution, rest)) = scratch.split_at_mut_checked(components) else {
            return Ok(());
        };
        let zeros = core::iter::repeat_n(S::constant(0.0), samples);
        self.run(zeros, Some(lambda), solution, rest);

        // Splits off row by row. A zip of chunks would divide by their length in a function where the compiler does not
        // see that it is not 0.
        let mut by_rows = &mut *gradient.basis;
        let rows = self.problem.rows().zip(mapped);
        for ((row, t), by_t) in rows.zip(gradient.mapped.iter_mut()) {
            let Some((by_row, rest)) =
                core::mem::take(&mut by_rows).split_at_mut_checked(components)
            else {
                break;
            };
            by_rows = rest;
            let projection = dot(row, solution);
            let residual = *t - dot(row, coefficients);
            *by_t = *by_t + projection;
            for ((by_a, s), c) in by_row.iter_mut().zip(&*solution).zip(coefficients) {
                *by_a = *by_a + residual * *s - projection * *c;
            }
        }
        for ((by_p, s), c) in gradient
            .precision
            .iter_mut()
            .zip(&*solution)
            .zip(coefficients)
        {
            *by_p = *by_p - *s * *c;
        }
        Ok(())
    }

    /// Computes x = (A'A + P)^-1 (lambda + A't). A lambda of None is 0. `scratch` has m + 3 r numbers.
    fn run(
        &self,
        mapped: impl Iterator<Item = S> + Clone,
        lambda: Option<&[S]>,
        x: &mut [S],
        scratch: &mut [S],
    ) {
        if self.problem.is_primal() {
            self.primal(mapped, lambda, x, scratch);
        } else {
            self.dual(mapped, lambda, x, scratch);
        }
    }

    /// Solves (A'A + P) x = lambda + A't.
    fn primal(
        &self,
        mapped: impl Iterator<Item = S> + Clone,
        lambda: Option<&[S]>,
        x: &mut [S],
        scratch: &mut [S],
    ) {
        initialize(x, lambda);
        for (row, t) in self.problem.rows().zip(mapped.clone()) {
            for (entry, a) in x.iter_mut().zip(row) {
                *entry = entry.plus_product(a.value(), t);
            }
        }
        ldl::solve(self.packed, x);

        // `high` and `low`: the residual lambda + A'(t - A x) - P x, in pairs.
        let Some((high, low)) = scratch.split_at_mut_checked(x.len()) else {
            return;
        };
        for _ in 0..S::REFINEMENTS {
            initialize(high, lambda);
            let pairs = high.iter_mut().zip(low.iter_mut());
            for (((high, low), p), x) in pairs.zip(self.problem.precision).zip(&*x) {
                let mut sum = Pair::new(*high);
                sum.add_product(-p.value(), *x);
                (*high, *low) = (sum.high, sum.low);
            }
            for (row, t) in self.problem.rows().zip(mapped.clone()) {
                let mut residual = Pair::new(t);
                for (a, x) in row.iter().zip(&*x) {
                    residual.add_product(-a.value(), *x);
                }
                add_scaled(row, residual.normalized(), high, low);
            }
            for (high, low) in high.iter_mut().zip(&*low) {
                *high = *high + *low;
            }
            ldl::solve(self.packed, high);
            for (x, correction) in x.iter_mut().zip(&*high) {
                *x = *x + *correction;
            }
            if !is_significant(high, x) {
                break;
            }
        }
    }

    /// Solves (A P^-1 A' + I) u = t - A P^-1 lambda, and computes x = P^-1 (lambda + A'u).
    fn dual(
        &self,
        mapped: impl Iterator<Item = S> + Clone,
        lambda: Option<&[S]>,
        x: &mut [S],
        scratch: &mut [S],
    ) {
        let order = self.problem.order();
        let (Some((low, rest)), true) = (scratch.split_at_mut_checked(x.len()), order > 0) else {
            return;
        };
        let mut lists = rest.chunks_exact_mut(order);
        let (Some(u), Some(u_low), Some(residual)) = (lists.next(), lists.next(), lists.next())
        else {
            return;
        };
        u.fill(S::constant(0.0));
        u_low.fill(S::constant(0.0));
        for pass in 0..=S::REFINEMENTS {
            // Without lambda, x is 0 at first.
            if pass > 0 || lambda.is_some() {
                self.recover(u, u_low, lambda, x, low);
            } else {
                x.fill(S::constant(0.0));
                low.fill(S::constant(0.0));
            }
            // The residual t - u - A x, in pairs.
            let rows = self.problem.rows().zip(mapped.clone());
            let us = u.iter().zip(&*u_low);
            for ((residual, (row, t)), (u, u_low)) in residual.iter_mut().zip(rows).zip(us) {
                let mut sum = Pair::new(t);
                sum.add(-*u);
                sum.low = sum.low - *u_low;
                for ((a, x), low) in row.iter().zip(&*x).zip(&*low) {
                    let x = Pair {
                        high: *x,
                        low: *low,
                    };
                    sum.add_product_of_pair(-a.value(), x);
                }
                *residual = sum.value();
            }
            ldl::solve(self.packed, residual);
            for ((u, u_low), correction) in u.iter_mut().zip(u_low.iter_mut()).zip(&*residual) {
                let mut sum = Pair {
                    high: *u,
                    low: *u_low,
                };
                sum.add(*correction);
                let sum = sum.normalized();
                (*u, *u_low) = (sum.high, sum.low);
            }
            if !is_significant(residual, u) {
                break;
            }
        }
        self.recover(u, u_low, lambda, x, low);
    }

    /// Computes x = P^-1 (lambda + A'u), in pairs.
    fn recover(&self, u: &[S], u_low: &[S], lambda: Option<&[S]>, x: &mut [S], low: &mut [S]) {
        initialize(x, lambda);
        low.fill(S::constant(0.0));
        for ((row, u), u_low) in self.problem.rows().zip(u).zip(u_low) {
            let u = Pair {
                high: *u,
                low: *u_low,
            };
            add_scaled(row, u, x, low);
        }
        let precision = self.problem.precision.iter();
        for ((x, low), p) in x.iter_mut().zip(low).zip(precision) {
            let sum = Pair {
                high: *x,
                low: *low,
            };
            let quotient = sum.divided_by(p.value());
            (*x, *low) = (quotient.high, quotient.low);
        }
    }
}

/// Returns false if a correction is NaN, or so small that rounding would hide the next one.
fn is_significant<S: Real>(correction: &[S], corrected: &[S]) -> bool {
    let square = |list: &[S]| dot(list, list);
    let small = S::constant(TOLERANCE * TOLERANCE) * square(corrected);
    square(correction) > small
}

/// Initializes a sum with lambda, or with 0.
fn initialize<S: Real>(x: &mut [S], lambda: Option<&[S]>) {
    match lambda {
        Some(lambda) => {
            for (x, lambda) in x.iter_mut().zip(lambda) {
                *x = *lambda;
            }
        }
        None => x.fill(S::constant(0.0)),
    }
}

/// Adds a row of A, times a pair, to pairs in two lists.
fn add_scaled<S: Real, T: Stored<S>>(row: &[T], factor: Pair<S>, high: &mut [S], low: &mut [S]) {
    for ((high, low), a) in high.iter_mut().zip(low).zip(row) {
        let mut sum = Pair {
            high: *high,
            low: *low,
        };
        sum.add_product_of_pair(a.value(), factor);
        (*high, *low) = (sum.high, sum.low);
    }
}

/// Checks the length of a caller's list.
fn check<S>(list: &[S], length: usize, part: Part) -> Result<(), RidgeError> {
    if list.len() == length {
        Ok(())
    } else {
        Err(RidgeError::Length {
            part,
            found: list.len(),
        })
    }
}
