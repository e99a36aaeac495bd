//! Kernels: the inner loop and its meta-gradient on this machine's lanes.

use std::marker::PhantomData;

use glimpse_core::model::{Model, SampleGradient};

use super::pattern::MeasuredPattern;
use super::pool::Draw;
use super::unroll::{Batch, Inner, MetaGradient, learn, meta_gradient};
use crate::lanes::{Kernel, Lanes, Octet};

impl<L: Lanes> Batch for L {
    #[inline(always)]
    fn total(self) -> f32 {
        Lanes::total(self)
    }
}

/// Initial parameters and step sizes, flat in the model's order, and how many steps.
#[derive(Clone, Copy, Debug)]
pub struct Learner<'a> {
    /// theta_0.
    pub initial: &'a [f32],
    /// alpha.
    pub step_sizes: &'a [f32],
    /// K.
    pub steps: usize,
}

/// Meta-gradient by initial parameters and step sizes, learning on drawn samples: one draw for
/// each step, or a single one for all of them.
pub struct DrawnGradient<'a, M> {
    /// What is differentiated by.
    pub learner: Learner<'a>,
    /// Samples to learn on.
    pub inner: &'a [&'a Draw<'a>],
    /// Samples to judge by.
    pub outer: &'a Draw<'a>,
    /// The model.
    pub model: PhantomData<M>,
}

impl<M: Model> Kernel for DrawnGradient<'_, M> {
    type Output = MetaGradient<f32, Octet>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let inner = Inner {
            samples: self.inner,
            steps: self.learner.steps,
        };
        let Learner {
            initial,
            step_sizes,
            ..
        } = self.learner;
        let found =
            meta_gradient::<M, L, Draw, Draw, false>(initial, step_sizes, &inner, self.outer);
        stored(found)
    }
}

/// Meta-gradient by initial parameters, step sizes and the samples of a measured pattern.
pub struct PatternGradient<'a, M> {
    /// What is differentiated by.
    pub learner: Learner<'a>,
    /// Samples to learn on.
    pub inner: &'a MeasuredPattern<'a>,
    /// Samples to judge by.
    pub outer: &'a Draw<'a>,
    /// The model.
    pub model: PhantomData<M>,
}

impl<M: Model> Kernel for PatternGradient<'_, M> {
    type Output = MetaGradient<f32, Octet>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let inner = Inner {
            samples: &[self.inner],
            steps: self.learner.steps,
        };
        let Learner {
            initial,
            step_sizes,
            ..
        } = self.learner;
        let found = meta_gradient::<M, L, MeasuredPattern, Draw, true>(
            initial, step_sizes, &inner, self.outer,
        );
        stored(found)
    }
}

/// Parameters after the inner loop on a measured pattern, flat; no gradient.
pub struct LearnPattern<'a, M> {
    /// How to learn.
    pub learner: Learner<'a>,
    /// What to learn on.
    pub inner: &'a MeasuredPattern<'a>,
    /// The model.
    pub model: PhantomData<M>,
}

impl<M: Model> Kernel for LearnPattern<'_, M> {
    type Output = M::Parameters<f32>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let inner = Inner {
            samples: &[self.inner],
            steps: self.learner.steps,
        };
        learn::<M, L, MeasuredPattern>(self.learner.initial, self.learner.step_sizes, &inner)
    }
}

/// The mean loss of given parameters over drawn samples.
pub struct OuterLoss<'a, M: Model> {
    /// theta.
    pub parameters: &'a M::Parameters<f32>,
    /// Where.
    pub outer: &'a Draw<'a>,
}

impl<M: Model> Kernel for OuterLoss<'_, M> {
    type Output = f32;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f32 {
        use glimpse_core::loss::cosine_weighted_log_error;

        use super::unroll::Samples;
        let mut loss = L::constant(0.0);
        for index in 0..Samples::<L>::batches(self.outer) {
            let sample = Samples::<L>::batch(self.outer, index);
            let modelled = M::brdf::<L>(self.parameters, &sample.at);
            let cosine = sample.at.cos_theta_i();
            let found = cosine_weighted_log_error(sample.measured, modelled, cosine, sample.weight);
            loss = loss + found.value;
        }
        Lanes::total(loss)
    }
}

#[inline(always)]
fn stored<L: Lanes>(found: MetaGradient<f32, L>) -> MetaGradient<f32, Octet> {
    let mut samples = Vec::with_capacity(found.samples.len());
    for SampleGradient { at, measured } in found.samples {
        let [red, green, blue] = measured;
        samples.push(SampleGradient {
            at: crate::lanes::OctetAt {
                hx: at.hx.store(),
                hz: at.hz.store(),
                dx: at.dx.store(),
                dy: at.dy.store(),
                dz: at.dz.store(),
            },
            measured: [red.store(), green.store(), blue.store()],
        });
    }
    MetaGradient {
        loss: found.loss,
        initial: found.initial,
        step_sizes: found.step_sizes,
        samples,
    }
}
