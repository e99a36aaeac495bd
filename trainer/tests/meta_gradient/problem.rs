//! A random inner loop and what judges it, in f64.

use std::ops::Range;

use glimpse_core::model::{Model, Sample};
use glimpse_core::scalar::Scalar;
use glimpse_trainer::meta::unroll::{Batch, Inner, MetaGradient, learn, meta_gradient};
use proptest::prelude::*;

use crate::support::cases::{Variables, sample, variables};
use crate::support::{Traced, parameters};

impl Batch for Traced {
    fn total(self) -> Self {
        self
    }
}

/// An inner loop and what judges it.
#[derive(Clone, Debug)]
pub(crate) struct Problem {
    pub(crate) initial: Vec<f64>,
    pub(crate) step_sizes: Vec<f64>,
    pub(crate) steps: usize,
    pub(crate) inner: Vec<Variables>,
    pub(crate) outer: Vec<Variables>,
}

/// The logarithm's range of step sizes that neither stand still nor run away.
pub(crate) const PHONG_STEPS: Range<f64> = -4.0..0.0;
/// The same for Cook-Torrance, whose highlights are more curved where alpha is small.
pub(crate) const COOK_TORRANCE_STEPS: Range<f64> = -5.0..-2.0;
/// The same for Neural.
pub(crate) const NEURAL_STEPS: Range<f64> = -6.0..-3.0;

/// Random problems with random initial parameters and step sizes.
pub(crate) fn problems<M: Model>(
    initial: impl Strategy<Value = Vec<f64>>,
    log_step_sizes: Range<f64>,
    steps: usize,
    samples: [usize; 2],
) -> impl Strategy<Value = Problem> {
    let step_sizes = prop::collection::vec(log_step_sizes.prop_map(f64::exp), M::PARAMETERS);
    let [inner, outer] = samples.map(|count| prop::collection::vec(variables(), count));
    (initial, step_sizes, inner, outer).prop_map(move |(initial, step_sizes, inner, outer)| {
        Problem {
            initial,
            step_sizes,
            steps,
            inner,
            outer,
        }
    })
}

/// Samples in equal weights: the mean over samples and channels.
fn samples<S: Scalar>(list: &[Variables]) -> Vec<Sample<S>> {
    let weight = 1.0 / (3.0 * list.len() as f64);
    list.iter().map(|each| sample(*each, weight)).collect()
}

impl Problem {
    /// The outer loss, every branch on the way recorded.
    pub(crate) fn loss<M: Model>(&self) -> Traced {
        let traced = |list: &[f64]| -> Vec<Traced> { list.iter().copied().map(Traced).collect() };
        let inner = samples(&self.inner);
        let inner = Inner {
            samples: &[&inner[..]],
            steps: self.steps,
        };
        let learned = learn::<M, Traced, [Sample<Traced>]>(
            &traced(&self.initial),
            &traced(&self.step_sizes),
            &inner,
        );
        let zero = Traced(0.0);
        let mut gradient = parameters([], zero);
        samples(&self.outer).iter().fold(zero, |sum, sample| {
            sum + M::accumulate_gradient::<Traced, false>(&learned, sample, &mut gradient).loss
        })
    }

    /// The meta-gradient under test.
    pub(crate) fn meta_gradient<M: Model>(&self) -> MetaGradient<f64, f64> {
        let inner = samples(&self.inner);
        let inner = Inner {
            samples: &[&inner[..]],
            steps: self.steps,
        };
        meta_gradient::<M, f64, [Sample<f64>], [Sample<f64>], true>(
            &self.initial,
            &self.step_sizes,
            &inner,
            &samples(&self.outer)[..],
        )
    }
}

/// The meta-gradient by the inner samples' variables, sample by sample.
///
/// Of these the ones by measured values are 0: the inner loss is an absolute difference of
/// logarithms, so its gradient by the parameters knows of a measured value only its side.
pub(crate) fn by_variables(found: &MetaGradient<f64, f64>) -> Vec<Variables> {
    let list = found.samples.iter().map(|by| {
        let [red, green, blue] = by.measured;
        let at = by.at;
        [at.hx, at.hz, at.dx, at.dy, at.dz, red, green, blue]
    });
    list.collect()
}
