//! Refinement of completed coefficients: a descent from initial parameters chosen by the InitNet.

use std::marker::PhantomData;

use glimpse_core::model::{ModelKind, ParameterSet, SampleGradient};
use glimpse_kernels::LaneModel;
use glimpse_kernels::inner_loop::{InnerLoop, MetaGradient};
use glimpse_kernels::lanes::Octet;
use glimpse_kernels::samples::SampleOctets;

/// A descent that starts from the initial parameters of a task.
pub trait Refinement: Sync {
    /// Returns the model.
    fn model(&self) -> ModelKind;

    /// Returns the number of steps, K.
    fn steps(&self) -> usize;

    /// Returns the parameters after a descent from `initial` on the `inner` samples.
    fn fit(&self, initial: &[f32], step_sizes: &[f32], inner: &SampleOctets<'_>) -> Vec<f32>;

    /// Returns the loss of parameters on the `outer` samples.
    fn loss(&self, parameters: &[f32], outer: &SampleOctets<'_>) -> f32;

    /// Returns the loss after the descent, and its gradient.
    fn gradient(
        &self,
        initial: &[f32],
        step_sizes: &[f32],
        inner: &SampleOctets<'_>,
        outer: &SampleOctets<'_>,
    ) -> RefinementGradient;
}

/// The loss after a descent, and its gradient.
pub struct RefinementGradient {
    /// The loss.
    pub loss: f32,
    /// The gradient with respect to the initial parameters.
    pub initial: Vec<f32>,
    /// The gradient with respect to the step sizes.
    pub step_sizes: Vec<f32>,
    /// The gradient with respect to the half and difference vectors of the inner samples.
    pub samples: Vec<SampleGradient<Octet>>,
}

/// A fixed number of steps of SGD.
pub struct SgdRefinement<M> {
    steps: usize,
    model: PhantomData<M>,
}

impl<M> SgdRefinement<M> {
    /// Creates a descent of `steps` steps, K.
    #[must_use]
    pub fn new(steps: usize) -> Self {
        Self {
            steps,
            model: PhantomData,
        }
    }
}

fn flatten<M: LaneModel>(parameters: &M::Parameters<f32>) -> Vec<f32> {
    parameters.iter().copied().collect()
}

impl<M: LaneModel> Refinement for SgdRefinement<M> {
    fn model(&self) -> ModelKind {
        M::KIND
    }

    fn steps(&self) -> usize {
        self.steps
    }

    fn fit(&self, initial: &[f32], step_sizes: &[f32], inner: &SampleOctets<'_>) -> Vec<f32> {
        let inner_loop = InnerLoop::<M, f32>::new(initial, step_sizes, self.steps);
        flatten::<M>(&M::fit(&inner_loop, inner))
    }

    fn loss(&self, parameters: &[f32], outer: &SampleOctets<'_>) -> f32 {
        // An inner loop of 0 steps, which has no use for step sizes, converts the parameters to those of the kernels.
        let inner_loop = InnerLoop::<M, f32>::new(parameters, parameters, 0);
        M::loss(&inner_loop.initial, outer)
    }

    fn gradient(
        &self,
        initial: &[f32],
        step_sizes: &[f32],
        inner: &SampleOctets<'_>,
        outer: &SampleOctets<'_>,
    ) -> RefinementGradient {
        let inner_loop = InnerLoop::<M, f32>::new(initial, step_sizes, self.steps);
        let mut meta_gradient = MetaGradient::<M, f32>::default();
        let mut samples = inner.zero_derivatives();
        let loss = M::meta_gradient(
            &mut meta_gradient,
            &inner_loop,
            &[inner],
            outer,
            Some(&mut samples),
        );
        RefinementGradient {
            loss,
            initial: flatten::<M>(&meta_gradient.initial),
            step_sizes: flatten::<M>(&meta_gradient.step_sizes),
            samples,
        }
    }
}
