//! Solves with a factorized ridge problem, refined; and their adjoint.

use super::ldl::{self, packed_length};
use super::pair::Pair;
use super::problem::take;
use super::{Part, Problem, Real, RidgeError, Stored, dot, is_positive};

/// A correction of this size, relative to what it corrects, is the last: the next one would be
/// smaller by at least as much as this one was smaller than the solution.
const SETTLED: f64 = 1e-5;

/// A factorized problem, for any number of right sides (also from several threads at once).
#[derive(Clone, Copy, Debug)]
pub struct Factors<'a, 'b, T, S> {
    pub(super) problem: Problem<'a, T>,
    pub(super) packed: &'b [S],
}

/// The derivatives of the loss, to which [`Factors::adjoint`] adds.
#[derive(Debug)]
pub struct RidgeGradient<'g, S> {
    /// By the mapped measurements t (n). (By the mean it is the negative.)
    pub mapped: &'g mut [S],
    /// By the basis A (n x m, row-major).
    pub basis: &'g mut [S],
    /// By the precisions p (m).
    pub precision: &'g mut [S],
}

impl<'a, T> Problem<'a, T> {
    /// Factorizes the system, in `factors` of at least [`factor_length`](super::factor_length). What
    /// `scratch` of at least [`scratch_length`](super::scratch_length) holds does not matter, before
    /// and after.
    ///
    /// # Errors
    /// [`RidgeError::Buffer`] or [`RidgeError::Precision`].
    pub fn factorize<'b, S: Real>(
        self,
        factors: &'b mut [S],
        scratch: &mut [S],
    ) -> Result<Factors<'a, 'b, T, S>, RidgeError>
    where
        T: Stored<S>,
    {
        let order = self.order();
        let packed = take(factors, packed_length(order), Part::Factors)?;
        let scratch = self.scratch(scratch)?;
        let wrong = |p: &T| !is_positive(p.value());
        if let Some(index) = self.precision.iter().position(wrong) {
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

    /// The factors in a buffer whose rows were all factorized by [`Problem::factorize_row`].
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

    /// c = (A'A + P)^-1 A't, for the mapped measurements t of one channel, minus the mean.
    ///
    /// # Errors
    /// [`RidgeError::Length`] if `mapped` is not n or `coefficients` not m long,
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

    /// (A'A + P)^-1 lambda, for any lambda of m entries.
    ///
    /// # Errors
    /// [`RidgeError::Length`] if `lambda` or `solution` is not m long, [`RidgeError::Buffer`] if
    /// `scratch` is too small.
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

    /// The derivatives of a loss whose derivative by the coefficients is `lambda`, added to
    /// `gradient`.
    ///
    /// `coefficients` are those that [`Factors::coefficients`] gave for `mapped`. With
    /// s = (A'A + P)^-1 lambda: d/dt = A s; d/dA_jk = (t - A c)_j s_k - (A s)_j c_k;
    /// d/dp_k = -s_k c_k.
    ///
    /// # Errors
    /// [`RidgeError::Length`] if a list is not n, m or n m long, [`RidgeError::Buffer`] if
    /// `scratch` is too small. Nothing was added then.
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

        // Row by row off the front: a zip of chunks divides by their length, out of line, where the
        // compiler no longer sees that it is not 0.
        let mut by_rows = &mut *gradient.basis;
        let rows = self.problem.rows().zip(mapped);
        for ((row, t), by_t) in rows.zip(gradient.mapped.iter_mut()) {
            let Some((by_row, rest)) =
                core::mem::take(&mut by_rows).split_at_mut_checked(components)
            else {
                break;
            };
            by_rows = rest;
            let along = dot(row, solution);
            let rest = *t - dot(row, coefficients);
            *by_t = *by_t + along;
            for ((by_a, s), c) in by_row.iter_mut().zip(&*solution).zip(coefficients) {
                *by_a = *by_a + rest * *s - along * *c;
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

    /// x = (A'A + P)^-1 (lambda + A't); no lambda stands for 0. `scratch` holds m + 3 r.
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

    /// (A'A + P) x = lambda + A't.
    fn primal(
        &self,
        mapped: impl Iterator<Item = S> + Clone,
        lambda: Option<&[S]>,
        x: &mut [S],
        scratch: &mut [S],
    ) {
        begin(x, lambda);
        for (row, t) in self.problem.rows().zip(mapped.clone()) {
            for (entry, a) in x.iter_mut().zip(row) {
                *entry = entry.plus_product(a.value(), t);
            }
        }
        ldl::solve(self.packed, x);

        // The residual lambda + A'(t - A x) - P x, in pairs.
        let Some((high, rest)) = scratch.split_at_mut_checked(x.len()) else {
            return;
        };
        for _ in 0..S::REFINEMENTS {
            begin(high, lambda);
            let low = rest.iter_mut();
            let precision = self.problem.precision.iter();
            for (((high, low), p), x) in high.iter_mut().zip(low).zip(precision).zip(&*x) {
                let mut sum = Pair::new(*high);
                sum.add_product(-p.value(), *x);
                (*high, *low) = (sum.high, sum.low);
            }
            for (row, t) in self.problem.rows().zip(mapped.clone()) {
                let mut left = Pair::new(t);
                for (a, x) in row.iter().zip(&*x) {
                    left.add_product(-a.value(), *x);
                }
                add_scaled(row, left.normalized(), high, rest);
            }
            for (high, low) in high.iter_mut().zip(&*rest) {
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

    /// (A P^-1 A' + I) u = t - A P^-1 lambda, x = P^-1 (lambda + A'u).
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
        let mut thirds = rest.chunks_exact_mut(order);
        let (Some(u), Some(u_low), Some(left)) = (thirds.next(), thirds.next(), thirds.next())
        else {
            return;
        };
        u.fill(S::constant(0.0));
        u_low.fill(S::constant(0.0));
        for pass in 0..=S::REFINEMENTS {
            // With no lambda x is 0 at first.
            if pass > 0 || lambda.is_some() {
                self.recover(u, u_low, lambda, x, low);
            } else {
                x.fill(S::constant(0.0));
                low.fill(S::constant(0.0));
            }
            // The residual t - u - A x, in pairs.
            let rows = self.problem.rows().zip(mapped.clone());
            let us = u.iter().zip(&*u_low);
            for ((left, (row, t)), (u, u_low)) in left.iter_mut().zip(rows).zip(us) {
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
                *left = sum.value();
            }
            ldl::solve(self.packed, left);
            for ((u, u_low), correction) in u.iter_mut().zip(u_low.iter_mut()).zip(&*left) {
                let mut sum = Pair {
                    high: *u,
                    low: *u_low,
                };
                sum.add(*correction);
                let sum = sum.normalized();
                (*u, *u_low) = (sum.high, sum.low);
            }
            if !is_significant(left, u) {
                break;
            }
        }
        self.recover(u, u_low, lambda, x, low);
    }

    /// x = P^-1 (lambda + A'u), in pairs.
    fn recover(&self, u: &[S], u_low: &[S], lambda: Option<&[S]>, x: &mut [S], low: &mut [S]) {
        begin(x, lambda);
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
            let quotient = sum.over(p.value());
            (*x, *low) = (quotient.high, quotient.low);
        }
    }
}

/// False if a correction was so small that the next would be lost in rounding; also if it is NaN.
fn is_significant<S: Real>(correction: &[S], corrected: &[S]) -> bool {
    let square = |list: &[S]| dot(list, list);
    let small = S::constant(SETTLED * SETTLED) * square(corrected);
    square(correction) > small
}

/// A vector to add to: lambda, or 0.
fn begin<S: Real>(x: &mut [S], lambda: Option<&[S]>) {
    match lambda {
        Some(lambda) => {
            for (x, lambda) in x.iter_mut().zip(lambda) {
                *x = *lambda;
            }
        }
        None => x.fill(S::constant(0.0)),
    }
}

/// Adds a row of A, times a pair, to pairs that lie in two lists.
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

/// A list of n or m that a caller gave.
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
