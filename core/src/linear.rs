//! The Linear model: a ridge solve on a basis that is reduced to the sampled directions.
//!
//! Nielsen, Jensen, Ramamoorthi: On Optimal, Minimal BRDF Sampling for Reflectance Acquisition
//! (2015). A BRDF is mapped by [`map`], and what was mapped is a mean plus m principal components
//! times coefficients c. At n directions, with the components' values there as the rows of the
//! n x m matrix A and t = mapped measurement - mean,
//!
//! ```text
//! c = argmin |A c - t|^2 + sum over k of p_k c_k^2 = (A'A + P)^-1 A't,   P = diag(p)
//! ```
//!
//! for each colour channel. The paper has p_k = eta for all k (its equation 7); a precision for
//! each component is a Gaussian prior on its coefficient.
//!
//! # The solve
//!
//! With u = t - A c the same c comes from (A P^-1 A' + I) u = t, c = P^-1 A'u. A [`Problem`] takes
//! whichever system has the smaller order, r = min(n, m), and factorizes it ([`Factors`]) as
//! L D L' in a buffer of the caller's. The factors depend on neither channel nor material: one
//! factorization, then two triangular solves for each right side.
//!
//! In f32 that alone may be off by a hundredth where A'A + P is ill-conditioned. So each solve is
//! followed by iterative refinement, its residual in twice the working precision (error-free
//! products from plain f32 operations; no f64): one step where the system is small, at most
//! [`Real::REFINEMENTS`]. The largest error |c - c of f64| / |c of f64|, as `tests/linear.rs`
//! measures it over n from 1 to 512, m from 1 to 240 and precisions from 1 to 1e4:
//!
//! | refinements | n = 8, m = 5 | n = 64, m = 60 | n = 512, m = 240 |
//! |---|---|---|---|
//! | none | 2e-6 | 6e-4 | 2e-2 |
//! | 1 | 4e-8 | 6e-7 | 3e-4 |
//! | as many as it takes | 4e-8 | 4e-8 | 2e-7 |
//!
//! # Memory
//!
//! [`factor_length`] and [`scratch_length`] numbers, as constants. The basis is read in place, from
//! flash if need be: packed little-endian f32, aligned or not (see [`Entry`]).

mod factor;
mod pair;

use serde::{Deserialize, Serialize};

use crate::scalar::Scalar;
use factor::packed_length;
use pair::Pair;

/// e of the mapping: what is added to the BRDF times both cosines, so that dark values have a
/// logarithm (Nielsen et al. 2015).
pub const EPSILON: f64 = 1e-3;
/// A correction of this size, relative to what it corrects, is the last: the next one would be
/// smaller by at least as much as this one was smaller than the solution.
const SETTLED: f64 = 1e-5;
/// The smallest weight that [`unmap`] divides by.
const LEAST_WEIGHT: f64 = 1e-6;

/// ln((brdf w + e) / (median w + e)), the paper's mapping.
///
/// `brdf` and `median` (over the training columns, at the same directions) are BRDFs in sr^-1, not
/// times a cosine; `weight` is w = cos(theta_i) cos(theta_o).
#[inline(always)]
pub fn map<S: Scalar>(brdf: S, median: S, weight: S) -> S {
    let epsilon = S::constant(EPSILON);
    let above = epsilon.plus_product(brdf, weight);
    let below = epsilon.plus_product(median, weight);
    (above / below).ln()
}

/// The inverse of [`map`]: max(((median w + e) exp(mapped) - e) / w, 0), a BRDF in sr^-1, not times
/// a cosine.
///
/// Where w is below 1e-6 it is divided by 1e-6 instead.
#[inline(always)]
pub fn unmap<S: Scalar>(mapped: S, median: S, weight: S) -> S {
    let epsilon = S::constant(EPSILON);
    let least = S::constant(LEAST_WEIGHT);
    let scaled = epsilon.plus_product(median, weight) * mapped.exp() - epsilon;
    let divisor = (weight - least).if_positive(weight, least);
    (scaled / divisor).relu()
}

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

/// How an entry of basis or precision lies in memory.
pub trait Entry<S>: Copy {
    /// The entry as a number.
    fn value(self) -> S;
}

impl<S: Real> Entry<S> for S {
    #[inline(always)]
    fn value(self) -> S {
        self
    }
}

/// Packed little-endian f32, as recipes hold them.
impl Entry<f32> for [u8; 4] {
    #[inline(always)]
    fn value(self) -> f32 {
        f32::from_le_bytes(self)
    }
}

/// What has a wrong length.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Part {
    /// The matrix A, n x m.
    Basis,
    /// The precisions p, m.
    Precision,
    /// The mapped measurements t, n.
    Mapped,
    /// The coefficients c, or another vector of m.
    Coefficients,
    /// The memory of the factors.
    Factors,
    /// The memory that a solve works in.
    Scratch,
}

impl core::fmt::Display for Part {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Basis => "basis",
            Self::Precision => "precision",
            Self::Mapped => "mapped measurements",
            Self::Coefficients => "coefficients",
            Self::Factors => "factors",
            Self::Scratch => "scratch",
        })
    }
}

/// Why a ridge problem cannot be solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum RidgeError {
    /// A list does not have the length that the others ask for.
    Length {
        /// Which.
        part: Part,
        /// Its length.
        found: usize,
    },
    /// A buffer is too small.
    Buffer {
        /// Which.
        part: Part,
        /// Numbers that it has to hold.
        needed: usize,
        /// Numbers that it has room for.
        found: usize,
    },
    /// The precision with this index is not positive.
    Precision(usize),
    /// The pivot with this index is not a positive, finite number: the problem is not finite, or too
    /// ill-conditioned for the arithmetic.
    Pivot(usize),
}

impl core::fmt::Display for RidgeError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Length { part, found } => {
                write!(f, "the ridge problem's {part} cannot have {found} entries")
            }
            Self::Buffer {
                part,
                needed,
                found,
            } => write!(
                f,
                "the ridge problem's {part} take {needed} numbers, there is room for {found}"
            ),
            Self::Precision(index) => {
                write!(f, "the precision of component {index} is not positive")
            }
            Self::Pivot(index) => {
                write!(
                    f,
                    "pivot {index} of the ridge problem is not positive: it is too ill-conditioned"
                )
            }
        }
    }
}

impl core::error::Error for RidgeError {}

/// Numbers that the factors of a problem take: r (r + 1) / 2, r = min(n, m).
#[must_use]
pub const fn factor_length(samples: usize, components: usize) -> usize {
    packed_length(order(samples, components))
}

/// Numbers that a solve or an adjoint works in: 2 m + 3 r, r = min(n, m).
#[must_use]
pub const fn scratch_length(samples: usize, components: usize) -> usize {
    2 * components + 3 * order(samples, components)
}

const fn order(samples: usize, components: usize) -> usize {
    if samples < components {
        samples
    } else {
        components
    }
}

/// A ridge problem without its right side: basis A and precisions p, read in place.
#[derive(Clone, Copy, Debug)]
pub struct Problem<'a, T> {
    basis: &'a [T],
    precision: &'a [T],
}

impl<'a, T> Problem<'a, T> {
    /// The problem with the basis A, n rows of m, row-major, and m precisions.
    ///
    /// # Errors
    /// [`RidgeError::Length`] if there is no precision, or not a whole number of rows, or none.
    pub fn new(basis: &'a [T], precision: &'a [T]) -> Result<Self, RidgeError> {
        let wrong = |part, list: &[T]| RidgeError::Length {
            part,
            found: list.len(),
        };
        match basis.len().checked_rem(precision.len()) {
            None => Err(wrong(Part::Precision, precision)),
            Some(0) if !basis.is_empty() => Ok(Self { basis, precision }),
            Some(_) => Err(wrong(Part::Basis, basis)),
        }
    }

    /// n, the number of samples.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.basis.len() / self.precision.len().max(1)
    }

    /// m, the number of components.
    #[must_use]
    pub fn components(&self) -> usize {
        self.precision.len()
    }

    /// r = min(n, m), the order of the system that is factorized.
    #[must_use]
    pub fn order(&self) -> usize {
        order(self.samples(), self.components())
    }

    /// The system in its smaller form is of order m: (A'A + P) c = A't.
    fn is_primal(&self) -> bool {
        self.components() <= self.samples()
    }

    /// The rows of A.
    fn rows(&self) -> impl Iterator<Item = &'a [T]> + Clone {
        self.basis.chunks_exact(self.precision.len().max(1))
    }

    /// Factorizes the system, in `factors` of at least [`factor_length`]. What `scratch` of at
    /// least [`scratch_length`] holds does not matter, before and after.
    ///
    /// # Errors
    /// [`RidgeError::Buffer`], [`RidgeError::Precision`], or [`RidgeError::Pivot`].
    pub fn factorize<'b, S: Real>(
        self,
        factors: &'b mut [S],
        scratch: &mut [S],
    ) -> Result<Factors<'a, 'b, T, S>, RidgeError>
    where
        T: Entry<S>,
    {
        let order = self.order();
        let packed = take(factors, packed_length(order), Part::Factors)?;
        let scratch = self.scratch(scratch)?;
        let zero = S::constant(0.0);
        if let Some(index) = self.precision.iter().position(|p| !(p.value() > zero)) {
            return Err(RidgeError::Precision(index));
        }
        if self.is_primal() {
            self.assemble_primal(packed);
        } else {
            self.assemble_dual(packed, scratch);
        }
        factor::factorize(packed, order)?;
        Ok(Factors {
            problem: self,
            packed,
        })
    }

    /// A'A + P.
    fn assemble_primal<S: Real>(&self, packed: &mut [S])
    where
        T: Entry<S>,
    {
        packed.fill(S::constant(0.0));
        for row in self.rows() {
            for (entries, left) in factor::rows_mut(packed).zip(row) {
                let left = left.value();
                for (entry, right) in entries.iter_mut().zip(row) {
                    *entry = entry.plus_product(left, right.value());
                }
            }
        }
        for (entries, precision) in factor::rows_mut(packed).zip(self.precision) {
            if let Some(diagonal) = entries.last_mut() {
                *diagonal = *diagonal + precision.value();
            }
        }
    }

    /// A P^-1 A' + I.
    fn assemble_dual<S: Real>(&self, packed: &mut [S], scratch: &mut [S])
    where
        T: Entry<S>,
    {
        for (entries, row) in factor::rows_mut(packed).zip(self.rows()) {
            for ((scaled, a), precision) in scratch.iter_mut().zip(row).zip(self.precision) {
                *scaled = a.value() / precision.value();
            }
            for (entry, other) in entries.iter_mut().zip(self.rows()) {
                *entry = dot(other, scratch);
            }
            if let Some(diagonal) = entries.last_mut() {
                *diagonal = *diagonal + S::constant(1.0);
            }
        }
    }

    /// The part of a buffer that a solve works in.
    fn scratch<'s, S>(&self, scratch: &'s mut [S]) -> Result<&'s mut [S], RidgeError> {
        let needed = scratch_length(self.samples(), self.components());
        take(scratch, needed, Part::Scratch)
    }
}

/// The first `needed` entries of a buffer.
fn take<S>(buffer: &mut [S], needed: usize, part: Part) -> Result<&mut [S], RidgeError> {
    let found = buffer.len();
    buffer.get_mut(..needed).ok_or(RidgeError::Buffer {
        part,
        needed,
        found,
    })
}

/// A row of A times a vector of m.
pub(crate) fn dot<S: Real, T: Entry<S>>(row: &[T], vector: &[S]) -> S {
    let products = row.iter().zip(vector);
    products.fold(S::constant(0.0), |sum, (a, x)| {
        sum.plus_product(a.value(), *x)
    })
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

/// A factorized problem, for any number of right sides (also from several threads at once).
#[derive(Clone, Copy, Debug)]
pub struct Factors<'a, 'b, T, S> {
    problem: Problem<'a, T>,
    packed: &'b [S],
}

/// Where [`Factors::adjoint`] adds the derivatives of the loss.
#[derive(Debug)]
pub struct RidgeGradient<'g, S> {
    /// By the mapped measurements t (n). (By the mean it is the negative.)
    pub mapped: &'g mut [S],
    /// By the basis A (n x m, row-major).
    pub basis: &'g mut [S],
    /// By the precisions p (m).
    pub precision: &'g mut [S],
}

impl<'a, T: Entry<S>, S: Real> Factors<'a, '_, T, S> {
    /// What was factorized.
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

        let by_rows = gradient.basis.chunks_exact_mut(components.max(1));
        let rows = self.problem.rows().zip(by_rows);
        for (((row, by_row), t), by_t) in rows.zip(mapped).zip(gradient.mapped.iter_mut()) {
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
        factor::solve(self.packed, x);

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
            factor::solve(self.packed, high);
            for (x, correction) in x.iter_mut().zip(&*high) {
                *x = *x + *correction;
            }
            if is_settled(high, x) {
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
                self.from_dual(u, u_low, lambda, x, low);
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
            factor::solve(self.packed, left);
            for ((u, u_low), correction) in u.iter_mut().zip(u_low.iter_mut()).zip(&*left) {
                let mut sum = Pair {
                    high: *u,
                    low: *u_low,
                };
                sum.add(*correction);
                let sum = sum.normalized();
                (*u, *u_low) = (sum.high, sum.low);
            }
            if is_settled(left, u) {
                break;
            }
        }
        self.from_dual(u, u_low, lambda, x, low);
    }

    /// x = P^-1 (lambda + A'u), in pairs.
    fn from_dual(&self, u: &[S], u_low: &[S], lambda: Option<&[S]>, x: &mut [S], low: &mut [S]) {
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

/// True if a correction was so small that the next would be lost in rounding.
fn is_settled<S: Real>(correction: &[S], corrected: &[S]) -> bool {
    let square = |list: &[S]| dot(list, list);
    let small = S::constant(SETTLED * SETTLED) * square(corrected);
    // Written so that a NaN ends it as well.
    !(square(correction) > small)
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
fn add_scaled<S: Real, T: Entry<S>>(row: &[T], factor: Pair<S>, high: &mut [S], low: &mut [S]) {
    for ((high, low), a) in high.iter_mut().zip(low).zip(row) {
        let mut sum = Pair {
            high: *high,
            low: *low,
        };
        sum.add_product_of_pair(a.value(), factor);
        (*high, *low) = (sum.high, sum.low);
    }
}
