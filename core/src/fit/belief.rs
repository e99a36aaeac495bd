//! A Gaussian belief about a material's coefficients, updated with one reading at a time, and how much a reading at
//! another direction would change it.
//!
//! The mean of the channels and their differences from it have a prior each, with a variance v_k for coefficient k. A
//! reading at a direction with the components q is q'z plus noise of variance s (s / 3 for the mean). After all readings,
//! the expected coefficients are those of the [ridge](super::ridge) solve with the precisions s / v_k.
//!
//! Each covariance S is kept as U D U' with a unit upper triangle U (Bierman 1977, "Factorization Methods for Discrete
//! Sequential Estimation", chapter V). Unlike an updated S, these factors keep it positive in f32.
//!
//! # The next direction
//!
//! The loss at a direction l is the magnitude of a change of the function ln(1 + f cos(theta_i)). It is expected to be
//! g sqrt(V), with the variance V of the mapped BRDF and the slope g of the function. A reading at q reduces V by
//! (l'S q)^2 / (q'S q + s), and so the expected losses by t'M t / (q'S q + s), with t = S q and the sum M of
//! g / (2 sqrt(V)) l l' over all l.

use super::ldl::{add_outer_product, dot, packed_length, rows};
use crate::model::linear::unmap;
use crate::numeric::{Real, split};

/// The lists of coefficients: of the mean, and of the differences of red, green and blue.
const LISTS: usize = 4;
/// The variance of the channels' mean, relative to that of a channel.
const MEAN_SHARE: f64 = 1.0 / 3.0;
/// The share of the differences' variance in a channel: the three differences sum to 0.
const DIFFERENCE_SHARE: f64 = 2.0 / 3.0;

/// The memory of a [`Belief`] in numbers, for K components: K² + 7 K.
#[must_use]
pub const fn belief_length(components: usize) -> usize {
    2 * packed_length(components) + (LISTS + 2) * components
}

/// The memory of [`Weights`] in numbers, for K components: K (K + 1) / 2.
#[must_use]
pub const fn weights_length(components: usize) -> usize {
    packed_length(components)
}

/// A Gaussian belief about the coefficients of a material, in a memory of [`belief_length`].
#[derive(Clone, Debug)]
pub struct Belief<S, M> {
    components: usize,
    memory: M,
    evidence: S,
}

/// The distribution of a mapped BRDF at a direction.
#[derive(Clone, Copy, Debug)]
pub struct Predicted<S> {
    /// The expected values of red, green and blue, minus the mean of the training.
    pub expected: [S; 3],
    /// The variance of the mean of the channels, and that of a channel's difference from it.
    pub variance: [S; 2],
}

impl<S: Real> Predicted<S> {
    /// Adds variances that the components do not express, those of a channel.
    #[must_use]
    pub fn with_misfit(self, misfit: S) -> Self {
        let [mean, difference] = self.variance;
        Self {
            variance: [
                mean.plus_product(misfit, S::constant(MEAN_SHARE)),
                difference + misfit,
            ],
            ..self
        }
    }

    /// The variance of a channel.
    #[must_use]
    pub fn channel_variance(&self) -> S {
        let [mean, difference] = self.variance;
        mean.plus_product(difference, S::constant(DIFFERENCE_SHARE))
    }
}

impl<S: Real, M: AsRef<[S]> + AsMut<[S]>> Belief<S, M> {
    /// Creates the belief before any reading. `variances` are those of the coefficients of the mean, and of the
    /// differences, K each. None if the memory is shorter than [`belief_length`].
    #[must_use]
    pub fn new(variances: [impl ExactSizeIterator<Item = S>; 2], memory: M) -> Option<Self> {
        let components = variances.iter().map(ExactSizeIterator::len).max()?;
        if memory.as_ref().len() < belief_length(components) {
            return None;
        }
        let mut belief = Self {
            components,
            memory,
            evidence: S::constant(0.0),
        };
        let [of_mean, of_differences, coefficients, ..] = belief.parts();
        coefficients.fill(S::constant(0.0));
        for (factors, variances) in [of_mean, of_differences].into_iter().zip(variances) {
            factors.fill(S::constant(0.0));
            for (index, variance) in variances.enumerate() {
                if let Some(entry) = factors.get_mut(packed_length(index) + index) {
                    *entry = variance;
                }
            }
        }
        Some(belief)
    }

    /// The parts of the memory: the factors of the mean and of the differences, packed (the entries of a column of U above
    /// the diagonal, then that of D), the expected coefficients of each list, and K numbers of scratch memory twice.
    fn parts(&mut self) -> [&mut [S]; 5] {
        let (components, triangle) = (self.components, packed_length(self.components));
        let lists = LISTS * components;
        let lengths = [triangle, triangle, lists, components, components];
        split(self.memory.as_mut(), lengths).unwrap_or_default()
    }

    /// The factors of the mean, of the differences, and the coefficients.
    fn read(&self) -> [&[S]; 3] {
        let triangle = packed_length(self.components);
        let memory = self.memory.as_ref().split_at_checked(triangle);
        let (of_mean, rest) = memory.unwrap_or_default();
        let (of_differences, rest) = rest.split_at_checked(triangle).unwrap_or_default();
        let coefficients = rest.get(..LISTS * self.components);
        [of_mean, of_differences, coefficients.unwrap_or_default()]
    }

    /// Adds a reading. `row` are the components at its direction, `targets` the mapped BRDF of red, green and blue minus
    /// the mean of the training, and `noise` the variance s of a channel's noise.
    pub fn add(&mut self, row: &[S], targets: [S; 3], noise: S) {
        let [red, green, blue] = targets;
        let mean = (red + green + blue) * S::constant(MEAN_SHARE);
        let lists = [mean, red - mean, green - mean, blue - mean];
        let components = self.components;
        let [of_mean, of_differences, coefficients, gain, scratch] = self.parts();
        let mut evidence = S::constant(0.0);
        let mut coefficients = coefficients.chunks_exact_mut(components.max(1)).zip(lists);
        for (factors, noise, lists) in [
            (of_mean, noise * S::constant(MEAN_SHARE), 1),
            (of_differences, noise, LISTS - 1),
        ] {
            let total = condition(factors, row, noise, gain, scratch);
            for (list, target) in coefficients.by_ref().take(lists) {
                let innovation = target - dot(list, row);
                let step = innovation / total;
                evidence = evidence.plus_product(innovation, step);
                for (entry, gain) in list.iter_mut().zip(&*gain) {
                    *entry = entry.plus_product(step, *gain);
                }
            }
        }
        self.evidence = self
            .evidence
            .plus_product(evidence, S::constant(MEAN_SHARE));
    }

    /// Assumes a reading that has its expected value.
    pub fn assume(&mut self, row: &[S], noise: S) {
        let predicted = self.predict(row);
        self.add(row, predicted.expected, noise);
    }

    /// Predicts the mapped BRDF at a direction.
    #[must_use]
    pub fn predict(&self, row: &[S]) -> Predicted<S> {
        let [of_mean, of_differences, coefficients] = self.read();
        let mut lists = coefficients.chunks_exact(self.components.max(1));
        let mut next = || dot(lists.next().unwrap_or_default(), row);
        let mean = next();
        Predicted {
            expected: [next(), next(), next()].map(|difference| mean + difference),
            variance: [of_mean, of_differences].map(|factors| multiply(factors, row, &mut [])),
        }
    }

    /// Returns by how much a reading at a direction would reduce the sum of the expected losses at the directions of the
    /// weights, over all channels.
    #[must_use]
    pub fn reduction<T: AsRef<[S]>>(&mut self, row: &[S], noise: S, weights: &Weights<S, T>) -> S {
        let [of_mean, of_differences, _, product, _] = self.parts();
        let mut of = |factors: &[S], noise: S| {
            let total = multiply(factors, row, product) + noise;
            weights.form(product) / total
        };
        let mean = of(of_mean, noise * S::constant(MEAN_SHARE));
        mean.plus_product(of(of_differences, noise), S::constant(DIFFERENCE_SHARE))
    }

    /// The expected coefficients: red, then green, then blue.
    pub fn coefficients(&self) -> impl Iterator<Item = S> + '_ {
        let [_, _, lists] = self.read();
        let (mean, differences) = lists.split_at_checked(self.components).unwrap_or_default();
        let each = differences.iter().zip(mean.iter().cycle());
        each.map(|(difference, mean)| *difference + *mean)
    }

    /// The squared Mahalanobis length of the readings under the prior, divided by 3: the mean has one list, the
    /// differences have two independent ones.
    #[must_use]
    pub fn evidence(&self) -> S {
        self.evidence
    }
}

/// The weights of the directions of an expected loss: the matrix M, in a memory of [`weights_length`].
#[derive(Debug)]
pub struct Weights<S, T> {
    triangle: T,
    loss: S,
}

impl<S: Real, T: AsRef<[S]>> Weights<S, T> {
    /// Creates weights without directions.
    #[must_use]
    pub fn new(mut triangle: T) -> Self
    where
        T: AsMut<[S]>,
    {
        triangle.as_mut().fill(S::constant(0.0));
        Self {
            triangle,
            loss: S::constant(0.0),
        }
    }

    /// Adds a direction. `center` is the mean of the training there, and `weight` is cos(theta_i) cos(theta_o).
    pub fn add(&mut self, row: &[S], predicted: &Predicted<S>, center: S, cos_theta_i: S, weight: S)
    where
        T: AsMut<[S]>,
    {
        let half = S::constant(0.5);
        let variance = predicted.channel_variance();
        let deviation = (half * variance.ln()).exp();
        let function = |mapped: S| (S::constant(1.0) + unmap(mapped, weight) * cos_theta_i).ln();
        let changes = predicted.expected.map(|expected| {
            let mapped = center + expected;
            half * (function(mapped + deviation) - function(mapped - deviation))
        });
        let [red, green, blue] = changes;
        let change = red + green + blue;
        self.loss = self.loss + change;
        let factor = half * change / variance;
        add_outer_product(self.triangle.as_mut(), row.iter().copied(), factor);
    }

    /// The sum of the expected losses at all directions, over all channels, if the change is that of one standard
    /// deviation.
    #[must_use]
    pub fn loss(&self) -> S {
        self.loss
    }

    /// Returns x'M x.
    fn form(&self, x: &[S]) -> S {
        let mut sum = S::constant(0.0);
        for (diagonal, row, entry, before) in columns(self.triangle.as_ref(), x) {
            let product = dot(row, before);
            sum = sum.plus_product(entry, product + product + diagonal * entry);
        }
        sum
    }
}

/// Returns the columns of a packed triangle: the entry on the diagonal, those above it, and the same two of `x`.
fn columns<'a, S: Copy>(
    packed: &'a [S],
    x: &'a [S],
) -> impl Iterator<Item = (S, &'a [S], S, &'a [S])> {
    let both = rows(packed).zip(x).enumerate();
    both.map_while(|(index, (column, entry))| {
        let (diagonal, column) = column.split_last()?;
        Some((*diagonal, column, *entry, x.get(..index)?))
    })
}

/// Writes S q to `product`, as far as it has room, and returns q'S q.
fn multiply<S: Real>(factors: &[S], row: &[S], product: &mut [S]) -> S {
    let mut sum = S::constant(0.0);
    for (index, (d, column, entry, before)) in columns(factors, row).enumerate() {
        let f = entry + dot(column, before);
        let v = d * f;
        sum = sum.plus_product(v, f);
        for (product, entry) in product.iter_mut().zip(column) {
            *product = product.plus_product(*entry, v);
        }
        if let Some(product) = product.get_mut(index) {
            *product = v;
        }
    }
    sum
}

/// Conditions on a reading. Writes S q to `gain`, with S before the reading, and returns q'S q plus the noise. `f` is
/// scratch memory of K numbers.
fn condition<S: Real>(factors: &mut [S], row: &[S], noise: S, gain: &mut [S], f: &mut [S]) -> S {
    for (f, (_, column, entry, before)) in f.iter_mut().zip(columns(factors, row)) {
        *f = entry + dot(column, before);
    }
    let mut total = noise;
    let mut rest = factors;
    for (index, f) in f.iter().enumerate() {
        let parts = core::mem::take(&mut rest).split_at_mut_checked(index);
        let Some((column, after)) = parts else { break };
        let Some((d, after)) = after.split_first_mut() else {
            break;
        };
        rest = after;
        let v = *d * *f;
        let before = total;
        total = total.plus_product(*f, v);
        *d = *d * before / total;
        let factor = -*f / before;
        for (entry, gain) in column.iter_mut().zip(gain.iter_mut()) {
            let old = *entry;
            *entry = old.plus_product(factor, *gain);
            *gain = gain.plus_product(v, old);
        }
        if let Some(gain) = gain.get_mut(index) {
            *gain = v;
        }
    }
    total
}
