//! What becomes of completed coefficients, besides the model Linear: a descent that they start.

use std::marker::PhantomData;

use glimpse_core::model::{ModelKind, ParameterSet, SampleGradient};
use glimpse_kernels::LaneModel;
use glimpse_kernels::inner_loop::{InnerLoop, MetaGradient};
use glimpse_kernels::lanes::Octet;
use glimpse_kernels::samples::SampleOctets;

/// A descent from a start of each task's own.
pub trait Refinement: Sync {
    /// The model.
    fn model(&self) -> ModelKind;

    /// K.
    fn steps(&self) -> usize;

    /// Descends on `inner` from `start`; the parameters.
    fn fit(&self, start: &[f32], step_sizes: &[f32], inner: &SampleOctets<'_>) -> Vec<f32>;

    /// The loss of parameters.
    fn loss(&self, parameters: &[f32], outer: &SampleOctets<'_>) -> f32;

    /// The loss after the descent, and its gradient.
    fn gradient(
        &self,
        start: &[f32],
        step_sizes: &[f32],
        inner: &SampleOctets<'_>,
        outer: &SampleOctets<'_>,
    ) -> RefinementGradient;
}

/// The loss after a descent, and its gradient.
pub struct RefinementGradient {
    /// The loss.
    pub loss: f32,
    /// By the parameters that it starts from.
    pub start: Vec<f32>,
    /// By the step sizes.
    pub step_sizes: Vec<f32>,
    /// By the samples' places.
    pub samples: Vec<SampleGradient<Octet>>,
}

/// So many steps of SGD.
pub struct Steps<M> {
    steps: usize,
    model: PhantomData<M>,
}

impl<M> Steps<M> {
    /// K of them.
    #[must_use]
    pub fn new(steps: usize) -> Self {
        Self {
            steps,
            model: PhantomData,
        }
    }
}

fn flat<M: LaneModel>(parameters: &M::Parameters<f32>) -> Vec<f32> {
    parameters.iter().copied().collect()
}

impl<M: LaneModel> Refinement for Steps<M> {
    fn model(&self) -> ModelKind {
        M::KIND
    }

    fn steps(&self) -> usize {
        self.steps
    }

    fn fit(&self, start: &[f32], step_sizes: &[f32], inner: &SampleOctets<'_>) -> Vec<f32> {
        let inner_loop = InnerLoop::<M, f32>::new(start, step_sizes, self.steps);
        flat::<M>(&M::fit(&inner_loop, inner))
    }

    fn loss(&self, parameters: &[f32], outer: &SampleOctets<'_>) -> f32 {
        let inner_loop = InnerLoop::<M, f32>::new(parameters, parameters, 0);
        M::loss(&inner_loop.initial, outer)
    }

    fn gradient(
        &self,
        start: &[f32],
        step_sizes: &[f32],
        inner: &SampleOctets<'_>,
        outer: &SampleOctets<'_>,
    ) -> RefinementGradient {
        let inner_loop = InnerLoop::<M, f32>::new(start, step_sizes, self.steps);
        let mut found = MetaGradient::<M, f32>::default();
        let mut samples = inner.zero_derivatives();
        let loss = M::meta_gradient(&mut found, &inner_loop, &[inner], outer, Some(&mut samples));
        RefinementGradient {
            loss,
            start: flat::<M>(&found.initial),
            step_sizes: flat::<M>(&found.step_sizes),
            samples,
        }
    }
}
