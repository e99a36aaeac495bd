//! Descent: a few steps of SGD with a step size per parameter, in bounded slices of work.
//!
//! theta <- theta - alpha * grad(loss), the loss being the mean over all samples (paper,
//! Algorithm 1, `Learn`). A unit of work is the gradient of one sample; after the last sample of
//! each round comes a step.

use super::Learner;
use super::fitter::{Fitter, FitterError, is_finite};
use super::learner::Descent;
use crate::geometry::HalfDifference;
use crate::model::linear::Basis;
use crate::model::{Model, ParameterSet, Sample};
use crate::numeric::Floats;

/// What a descent works in: parameters and their gradient.
#[derive(Clone, Debug)]
pub struct Workspace<M: Model> {
    parameters: M::Parameters<f32>,
    gradient: M::Parameters<f32>,
}

impl<M: Model> Workspace<M> {
    /// All zeros.
    pub const EMPTY: Self = Self {
        parameters: M::ZEROS,
        gradient: M::ZEROS,
    };
}

impl Descent<'_> {
    /// Gradients of one sample that the whole fit takes: samples times steps.
    pub(super) fn gradients(&self, samples: usize) -> u32 {
        u32::from(self.inner_steps).saturating_mul(samples as u32)
    }
}

impl<M: Model> Fitter for M {
    type Workspace = Workspace<M>;
    const EMPTY: Workspace<M> = Workspace::EMPTY;

    fn accept(learner: &Learner<'_>, _: usize) -> Result<(), FitterError> {
        let (firmware, recipe) = (M::KIND, learner.model());
        if firmware == recipe {
            Ok(())
        } else {
            Err(FitterError::Model { firmware, recipe })
        }
    }

    fn total(learner: &Learner<'_>, samples: usize) -> u32 {
        match learner {
            Learner::Descent(descent) => descent.gradients(samples),
            Learner::Ridge(_) => 0,
        }
    }

    fn start(workspace: &mut Workspace<M>, learner: &Learner<'_>) {
        if let Learner::Descent(descent) = learner {
            let initial = descent.initial.iter();
            for (parameter, value) in workspace.parameters.iter_mut().zip(initial) {
                *parameter = value;
            }
        }
        workspace.gradient.iter_mut().for_each(|entry| *entry = 0.0);
    }

    fn advance(
        workspace: &mut Workspace<M>,
        learner: &Learner<'_>,
        samples: &[Sample<f32>],
        done: u32,
        budget: u32,
    ) -> u32 {
        let Learner::Descent(descent) = learner else {
            return done;
        };
        let mut done = done;
        let end = done
            .saturating_add(budget)
            .min(descent.gradients(samples.len()));
        // Where in its round the next sample is; there is no round without samples.
        let mut next = done.checked_rem(samples.len() as u32).unwrap_or(0) as usize;
        while done < end {
            let todo = samples.get(next..).unwrap_or_default();
            let todo = todo.get(..(end - done) as usize).unwrap_or(todo);
            if todo.is_empty() {
                break;
            }
            accumulate_gradients::<M>(&workspace.parameters, todo, &mut workspace.gradient);
            done = done.saturating_add(todo.len() as u32);
            next = next.saturating_add(todo.len());
            if next >= samples.len() {
                next = 0;
                update(workspace, descent.step_sizes);
            }
        }
        done
    }

    fn values<'w>(workspace: &'w Workspace<M>, _: Learner<'w>) -> impl Iterator<Item = f32> + 'w {
        workspace.parameters.iter().copied()
    }

    fn is_finite(workspace: &Workspace<M>, _: &Learner<'_>) -> bool {
        workspace.parameters.runs().all(is_finite)
    }

    fn at_sample(
        workspace: &Workspace<M>,
        _: &Learner<'_>,
        _: usize,
        at: &HalfDifference<f32>,
    ) -> [f32; 3] {
        brdf::<M>(&workspace.parameters, at)
    }

    fn brdf(
        workspace: &Workspace<M>,
        _: &Learner<'_>,
        _: Option<&Basis<'_>>,
        at: &HalfDifference<f32>,
    ) -> Option<[f32; 3]> {
        Some(brdf::<M>(&workspace.parameters, at))
    }
}

fn update<M: Model>(workspace: &mut Workspace<M>, step_sizes: Floats<'_>) {
    // Run by run: a loop over plain slices takes a fifth of a flattened iterator's time.
    let mut step_sizes = step_sizes;
    let runs = workspace.parameters.runs_mut();
    for (parameters, gradient) in runs.zip(workspace.gradient.runs_mut()) {
        step(parameters, gradient, step_sizes.take(parameters.len()));
    }
}

/// One step, after which the gradient is 0. Out of line: the code is there once and not for each run.
#[inline(never)]
fn step(parameters: &mut [f32], gradient: &mut [f32], step_sizes: Floats<'_>) {
    // Three at a time, which all runs of Neural are multiples of: to go round takes a third of the
    // time that an entry does.
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
    for ((parameter, entry), step_size) in last.zip(last_step_sizes) {
        step_one(parameter, entry, *step_size);
    }
}

#[inline(always)]
fn step_one(parameter: &mut f32, entry: &mut f32, step_size: [u8; 4]) {
    *parameter -= f32::from_le_bytes(step_size) * *entry;
    *entry = 0.0;
}

/// Kept out of line: its temporaries are off the stack between slices of work.
///
/// Parameters and gradient come one by one, though a workspace holds both: as parts of one whole
/// they are addressed from one pointer, which their distance is too large for.
#[inline(never)]
fn accumulate_gradients<M: Model>(
    parameters: &M::Parameters<f32>,
    samples: &[Sample<f32>],
    gradient: &mut M::Parameters<f32>,
) {
    M::accumulate_gradients(parameters, samples, gradient);
}

/// The model's BRDF, sr^-1 (not times the cosine). Out of line for the same reason.
#[inline(never)]
pub fn brdf<M: Model>(parameters: &M::Parameters<f32>, at: &HalfDifference<f32>) -> [f32; 3] {
    M::brdf::<f32>(parameters, at)
}
