//! Random inner loops with outer samples, in f64.

use std::ops::Range;

use glimpse_core::model::{Model, ParameterSet, Sample, SampleGradient};
use glimpse_core::numeric::Scalar;
use glimpse_kernels::inner_loop::{InnerLoop, MetaGradient, Real, SampleList};
use proptest::prelude::*;

use glimpse_gradcheck::cases::{Variables, sample, variables};
use glimpse_gradcheck::parameters;

/// An inner loop with inner and outer samples.
#[derive(Clone, Debug)]
pub(crate) struct Problem {
    pub(crate) initial: Vec<f64>,
    pub(crate) step_sizes: Vec<f64>,
    pub(crate) steps: usize,
    pub(crate) inner: Vec<Variables>,
    pub(crate) outer: Vec<Variables>,
}

/// Range of ln(step size) for Phong. Smaller steps have no effect, and larger ones diverge.
pub(crate) const PHONG_LOG_STEP_SIZES: Range<f64> = -4.0..0.0;
/// Range of ln(step size) for Cook-Torrance, whose highlights have a higher curvature at small alpha.
pub(crate) const COOK_TORRANCE_LOG_STEP_SIZES: Range<f64> = -5.0..-2.0;
/// Range of ln(step size) for Neural.
pub(crate) const NEURAL_LOG_STEP_SIZES: Range<f64> = -6.0..-3.0;

/// Returns a strategy for problems with random initial parameters, step sizes and samples. `samples` are the numbers of
/// inner and outer samples.
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

/// Converts variables to samples of equal weight, for the mean over samples and channels.
fn samples<S: Scalar>(list: impl ExactSizeIterator<Item = [S; 8]>) -> Vec<Sample<S>> {
    let weight = 1.0 / (3.0 * list.len() as f64);
    list.map(|each| sample(each, weight)).collect()
}

impl Problem {
    /// Returns theta_0, alpha, and the variables of the inner samples in one list.
    pub(crate) fn inputs(&self) -> Vec<f64> {
        let inner = self.inner.as_flattened();
        [&self.initial[..], &self.step_sizes, inner].concat()
    }

    /// Returns the outer loss of inputs, computed forward.
    pub(crate) fn loss<M: Model, S: Real>(&self, inputs: &[S]) -> S {
        let (initial, rest) = inputs.split_at(M::PARAMETERS);
        let (step_sizes, inner) = rest.split_at(M::PARAMETERS);
        let inner_loop = InnerLoop::<M, S>::new(initial, step_sizes, self.steps);
        let inner = samples(inner.as_chunks().0.iter().copied());
        let fitted = inner_loop.fit(&inner[..]);
        let zero = S::constant(0.0);
        let mut gradient = parameters([], zero);
        let outer = self.outer.iter().map(|each| each.map(S::constant));
        samples(outer).iter().fold(zero, |sum, sample| {
            sum + M::accumulate_gradient::<S, false>(&fitted, sample, &mut gradient).loss()
        })
    }

    /// Returns the meta-gradient under test.
    pub(crate) fn meta_gradient<M: Model>(&self) -> LossGradient<f64, SampleGradient<f64>> {
        let inner_loop = InnerLoop::<M, f64>::new(&self.initial, &self.step_sizes, self.steps);
        let inner = samples(self.inner.iter().copied());
        let outer = samples(self.outer.iter().copied());
        let by_samples = vec![SampleGradient::zero(); inner.len()];
        LossGradient::compute(&inner_loop, &[&inner[..]], &outer[..], by_samples)
    }
}

/// A loss and its gradients as flat lists.
pub(crate) struct LossGradient<R, G> {
    pub(crate) loss: R,
    pub(crate) initial: Vec<R>,
    pub(crate) step_sizes: Vec<R>,
    pub(crate) samples: Vec<G>,
}

impl<R: Real, G> LossGradient<R, G> {
    /// Computes the meta-gradient. `by_samples` holds a zero for each inner sample, or is empty to omit the gradient
    /// with respect to the samples.
    pub(crate) fn compute<M: Model, I, O>(
        inner_loop: &InnerLoop<M, R>,
        inner: &[&I],
        outer: &O,
        mut by_samples: Vec<G>,
    ) -> Self
    where
        I: SampleList<M, R, Derivatives = G> + ?Sized,
        O: SampleList<M, R> + ?Sized,
    {
        let mut meta_gradient = MetaGradient::<M, R>::default();
        let derivatives = Some(&mut by_samples[..]).filter(|derivatives| !derivatives.is_empty());
        let loss = meta_gradient.compute(inner_loop, inner, outer, derivatives);
        Self {
            loss,
            initial: meta_gradient.initial.iter().copied().collect(),
            step_sizes: meta_gradient.step_sizes.iter().copied().collect(),
            samples: by_samples,
        }
    }
}

/// Returns the meta-gradient with respect to the variables of each inner sample.
///
/// The entries of measured values are 0. The inner loss is an absolute difference of logarithms, so its gradient with
/// respect to the parameters depends on a measured value only by the sign of the difference.
pub(crate) fn gradient_by_variables(
    gradient: &LossGradient<f64, SampleGradient<f64>>,
) -> Vec<Variables> {
    let list = gradient.samples.iter().map(|by_sample| {
        let [red, green, blue] = by_sample.measured;
        let at = by_sample.at;
        [at.hx, at.hz, at.dx, at.dy, at.dz, red, green, blue]
    });
    list.collect()
}
