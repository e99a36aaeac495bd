//! The fit: a few steps of SGD with a step size per parameter, in bounded slices of work.
//!
//! theta <- theta - alpha * grad(loss), the loss being the mean over all samples (paper,
//! Algorithm 1, `Learn`).

use serde::{Deserialize, Serialize};

use crate::geometry::HalfDifference;
use crate::model::loss::cosine_weighted_log_error;
use crate::model::{Model, ParameterSet, Sample};
use crate::numeric::Floats;

/// The memory of a fit, which the caller owns: parameters and their gradient.
///
/// It can live in a static that costs no flash: [`Workspace::new`] is a constant, all zeros.
#[derive(Clone, Debug)]
pub struct Workspace<M: Model> {
    parameters: M::Parameters<f32>,
    gradient: M::Parameters<f32>,
}

impl<M: Model> Default for Workspace<M> {
    fn default() -> Self {
        Self::new()
    }
}

impl<M: Model> Workspace<M> {
    /// All zeros.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            parameters: M::ZEROS,
            gradient: M::ZEROS,
        }
    }

    /// The parameters as they are now.
    #[must_use]
    pub fn parameters(&self) -> &M::Parameters<f32> {
        &self.parameters
    }
}

/// How far a fit is, counted in gradients of one sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Progress {
    /// Gradients computed.
    pub done: u32,
    /// Gradients that the whole fit takes: samples times steps.
    pub total: u32,
}

impl Progress {
    /// True if nothing is left to do.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.done >= self.total
    }
}

/// A fit that is under way. It holds where it is; the caller holds workspace and samples.
#[derive(Clone, Copy, Debug)]
pub struct Fit<'a> {
    step_sizes: Floats<'a>,
    steps: u16,
    step: u16,
    sample: usize,
}

impl<'a> Fit<'a> {
    /// Begins a fit: `workspace` starts at the initial parameters.
    pub fn start<M: Model>(
        workspace: &mut Workspace<M>,
        initial: Floats<'_>,
        step_sizes: Floats<'a>,
        steps: u16,
    ) -> Self {
        for (parameter, value) in workspace.parameters.iter_mut().zip(initial.iter()) {
            *parameter = value;
        }
        workspace.gradient.iter_mut().for_each(|entry| *entry = 0.0);
        Self {
            step_sizes,
            steps,
            step: 0,
            sample: 0,
        }
    }

    /// Computes the gradients of at most `budget` samples, and a step after each last sample.
    ///
    /// `samples` and `workspace` must be the same from call to call; the result does not depend
    /// on the budgets.
    pub fn advance<M: Model>(
        &mut self,
        workspace: &mut Workspace<M>,
        samples: &[Sample<f32>],
        budget: usize,
    ) -> Progress {
        let mut left = budget;
        while self.step < self.steps {
            let todo = samples.get(self.sample..).unwrap_or_default();
            let done = todo.len().min(left);
            accumulate_gradients::<M>(
                &workspace.parameters,
                todo.get(..done).unwrap_or_default(),
                &mut workspace.gradient,
            );
            left = left.saturating_sub(done);
            self.sample = self.sample.saturating_add(done);
            if self.sample < samples.len() {
                break;
            }
            self.sample = 0;
            self.step = self.step.saturating_add(1);
            self.update(workspace);
            if left == 0 {
                break;
            }
        }
        let samples = samples.len() as u32;
        Progress {
            done: u32::from(self.step)
                .saturating_mul(samples)
                .saturating_add(self.sample as u32),
            total: u32::from(self.steps).saturating_mul(samples),
        }
    }

    fn update<M: Model>(&self, workspace: &mut Workspace<M>) {
        // Run by run: a loop over plain slices takes a fifth of a flattened iterator's time.
        let mut step_sizes = self.step_sizes;
        let runs = workspace.parameters.runs_mut();
        for (parameters, gradient) in runs.zip(workspace.gradient.runs_mut()) {
            step(parameters, gradient, step_sizes.take(parameters.len()));
        }
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

/// The error of each sample under `parameters`: the mean over its channels, whatever its weight.
pub fn residuals<M: Model>(
    parameters: &M::Parameters<f32>,
    samples: &[Sample<f32>],
) -> impl Iterator<Item = f32> {
    samples.iter().map(|sample| {
        let modelled = brdf::<M>(parameters, &sample.at);
        let cosine = sample.at.cos_theta_i();
        cosine_weighted_log_error(sample.measured, modelled, cosine, 1.0 / 3.0)
            .error
            .value()
    })
}
