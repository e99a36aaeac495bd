//! The steps of the paper's Algorithm 1, `Learn`: a few steps of SGD with a step size for each parameter.
//!
//! theta <- theta - alpha * grad(loss), where the loss is the mean over all samples. A unit of work is the gradient of
//! one sample. After a round over all samples, a step changes the parameters.

use core::ops::Range;

use super::channels::{Readings, keep_gray};
use crate::model::{ModelKind, Samples};
use crate::numeric::{Floats, split};
use crate::section::section;

section! {
    /// Steps of gradient descent on the loss at the n samples, from constant initial parameters.
    Sgd<'a> = 1, "sgd" {
        /// 0 Phong, 1 Neural, 2 Cook-Torrance
        model: ModelKind, in 0.0 => 2.0;
        /// number of steps
        steps: u16, in 1.0 => 10_000.0;
        /// initial parameters, in the model's order
        initial: Floats<'a>, [Parameters];
        /// a step size for each of them
        step_sizes: Floats<'a>, [Parameters];
    }
}

/// Adds the loss gradients of samples at some parameters to a gradient.
pub(super) type AddGradients = fn(&[f32], Samples<'_>, &mut [f32]);

impl Sgd<'_> {
    /// The memory in words: the parameters and their gradient.
    pub(super) fn words(&self) -> usize {
        self.initial.len().saturating_mul(2)
    }

    /// The units of work.
    pub(super) fn units(&self, samples: usize) -> u32 {
        u32::from(self.steps).saturating_mul(samples as u32)
    }

    /// Does units of work.
    #[inline(never)]
    pub(super) fn advance(
        &self,
        add_gradients: AddGradients,
        words: &mut [f32],
        (samples, channels): Readings<'_>,
        units: Range<u32>,
    ) {
        let Some([parameters, gradient]) = split(words, [self.initial.len(); 2]) else {
            return;
        };
        let Range { start, end } = units;
        let mut done = start;
        while done < end {
            // `checked_rem` returns None without samples.
            let next = done.checked_rem(samples.len() as u32).unwrap_or_default();
            let batch = samples.skip(next as usize).take((end - done) as usize);
            if batch.is_empty() {
                return;
            }
            add_gradients(parameters, batch, gradient);
            done = done.saturating_add(batch.len() as u32);
            if (next as usize).saturating_add(batch.len()) >= samples.len() {
                step(parameters, gradient, self.step_sizes);
                keep_gray(parameters, self.model, channels);
            }
        }
    }
}

/// Takes one step, and sets the gradient to 0. Not inlined, so firmware contains it once and not for each model.
#[inline(never)]
fn step(parameters: &mut [f32], gradient: &mut [f32], step_sizes: Floats<'_>) {
    // Three entries per iteration, because the loop itself takes a third of the time of an entry. Neural's parameters
    // have no remainder.
    let (parameters, last_parameters) = parameters.as_chunks_mut();
    let (gradient, last_gradient) = gradient.as_chunks_mut();
    let (step_sizes, last_step_sizes) = step_sizes.words().as_chunks();
    let threes = parameters.iter_mut().zip(gradient).zip(step_sizes);
    for (([p, q, r], [by_p, by_q, by_r]), [alpha_p, alpha_q, alpha_r]) in threes {
        step_one(p, by_p, *alpha_p);
        step_one(q, by_q, *alpha_q);
        step_one(r, by_r, *alpha_r);
    }
    let last = last_parameters.iter_mut().zip(last_gradient);
    for ((parameter, gradient), step_size) in last.zip(last_step_sizes) {
        step_one(parameter, gradient, *step_size);
    }
}

#[inline(always)]
fn step_one(parameter: &mut f32, gradient: &mut f32, step_size: [u8; 4]) {
    *parameter -= f32::from_le_bytes(step_size) * *gradient;
    *gradient = 0.0;
}
