//! The outer loop: phases of Adam steps on meta-gradients over batches of tasks.

use std::marker::PhantomData;

use glimpse_core::model::ParameterSet;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::gradient::LaneModel;
use super::parameters::{Groups, Optimization};
use super::pattern::Pattern;
use super::pool::{Draw, Pool, Variation};
use super::unroll::{Learner, MetaGradient};
use crate::material::Material;

/// What the inner loop learns on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InnerSamples {
    /// So many fresh uniform samples at every step.
    Fresh(usize),
    /// So many uniform samples, the same at every step.
    Random(usize),
    /// The pattern's samples, the same at every step.
    Pattern,
}

/// Where a phase's meta-parameters come from. All but [`Start::Previous`] reset Adam's moments.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// A first guess of its own, by this number.
    Guess(u64),
    /// The phase before.
    Previous,
    /// The best meta-parameters that any phase has found, by their validation loss.
    Best,
}

/// One stage of meta-training.
#[derive(Clone, Debug)]
pub struct Phase {
    /// For progress reports.
    pub name: &'static str,
    /// Where it begins.
    pub start: Start,
    /// Outer steps.
    pub steps: usize,
    /// Tasks in each.
    pub batch: usize,
    /// What to learn on.
    pub inner: InnerSamples,
    /// How many samples to judge by.
    pub outer: usize,
    /// Learning rates at its start; 0 freezes a group.
    pub rates: Groups<f64>,
    /// Learning rates at its end, as a share of those at its start (cosine annealing).
    pub final_rate: f64,
    /// Steps over which the rates rise to their start.
    pub warm_up: usize,
    /// Train on [random variations](Variation::random) with this gain rather than on the
    /// materials as they are.
    pub gain: Option<f32>,
}

impl Phase {
    /// The learning rates of a step.
    fn rates_at(&self, step: usize) -> Groups<f64> {
        let done = step as f64 / self.steps as f64;
        let cosine = 0.5 * (1.0 + (std::f64::consts::PI * done).cos());
        let annealed = self.final_rate + (1.0 - self.final_rate) * cosine;
        let risen = ((step + 1) as f64 / self.warm_up.max(1) as f64).min(1.0);
        let share = annealed * risen;
        Groups {
            initial: self.rates.initial * share,
            step_sizes: self.rates.step_sizes * share,
            pattern: self.rates.pattern * share,
        }
    }
}

/// What is optimized for the step sizes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepSizeForm {
    /// alpha itself, of any sign, as in the paper.
    Plain,
    /// ln alpha: alpha stays positive, and Adam's steps are relative.
    Logarithm,
}

impl StepSizeForm {
    /// alpha of what is optimized.
    #[must_use]
    pub fn step_sizes(self, values: &[f32]) -> Vec<f32> {
        match self {
            Self::Plain => values.to_vec(),
            Self::Logarithm => values.iter().map(|log| log.exp()).collect(),
        }
    }

    /// What is optimized for an alpha.
    #[must_use]
    pub fn value(self, step_size: f32) -> f32 {
        match self {
            Self::Plain => step_size,
            Self::Logarithm => step_size.ln(),
        }
    }

    /// From the gradient by alpha to the one by what is optimized.
    fn chain(self, gradient: &mut [f32], step_sizes: &[f32]) {
        if self == Self::Logarithm {
            for (gradient, step_size) in gradient.iter_mut().zip(step_sizes) {
                *gradient *= step_size;
            }
        }
    }
}

/// The tasks of training: materials, and their values at the pool of directions.
pub struct Tasks<'a> {
    /// The materials.
    pub materials: &'a [Box<dyn Material>],
    /// Their values.
    pub pool: Pool,
}

/// A training run.
pub struct Training<'a, M: LaneModel> {
    /// The tasks.
    pub tasks: &'a Tasks<'a>,
    /// The phases, in order.
    pub phases: &'a [Phase],
    /// Inner steps, K.
    pub inner_steps: usize,
    /// Seed of all random numbers.
    pub seed: u64,
    /// What the group of step sizes holds.
    pub step_size_form: StepSizeForm,
    /// The meta-parameters.
    pub optimization: Optimization,
    /// The model.
    pub model: PhantomData<M>,
}

/// Gradients of all groups are scaled down to at most this norm, each group by itself.
const LARGEST_NORM: f32 = 1.0;

impl<M: LaneModel> Training<'_, M> {
    /// One outer step; returns the mean outer loss of its batch.
    pub fn step(&mut self, phase_index: usize, step: usize) -> f32 {
        let phase = &self.phases[phase_index];
        let values = self.optimization.values();
        let step_sizes = self.step_size_form.step_sizes(&values.step_sizes);
        let learner = Learner::new(&values.initial, &step_sizes, self.inner_steps);
        let pattern = Pattern::from_logits(&values.pattern);
        let chosen = self.batch(phase_index, step);
        let found: Vec<(f32, Groups<Vec<f32>>)> = chosen
            .par_iter()
            .enumerate()
            .map(|(slot, task)| {
                let mut random = self.random(phase_index, step, slot + 1);
                self.task_gradient(phase, &learner, &pattern, *task, &mut random)
            })
            .collect();
        // Summed in the batch's order, whichever thread was first.
        let share = 1.0 / found.len() as f32;
        let mut loss = 0.0;
        let mut sum = Groups {
            initial: vec![0.0; values.initial.len()],
            step_sizes: vec![0.0; step_sizes.len()],
            pattern: vec![0.0; values.pattern.len()],
        };
        for (task_loss, gradients) in &found {
            loss += share * task_loss;
            for (sum, gradient) in sum.each_mut().into_iter().zip(gradients.each()) {
                for (sum, value) in sum.iter_mut().zip(gradient) {
                    *sum += share * value;
                }
            }
        }
        self.step_size_form.chain(&mut sum.step_sizes, &step_sizes);
        for gradient in sum.each_mut() {
            clip(gradient);
        }
        self.optimization.step(sum, &phase.rates_at(step));
        loss
    }

    fn task_gradient(
        &self,
        phase: &Phase,
        learner: &Learner<M, f32>,
        pattern: &Pattern,
        task: usize,
        random: &mut ChaCha8Rng,
    ) -> (f32, Groups<Vec<f32>>) {
        let pool = &self.tasks.pool;
        let variation = match phase.gain {
            Some(gain) => Variation::random(gain, random),
            None => Variation::NONE,
        };
        let outer = pool.draw(task, variation, phase.outer, random);
        let outer = outer.octets();
        let mut by_pattern = vec![0.0; 3 * pattern.angles().len()];
        let mut found = MetaGradient::<M, f32>::default();
        let loss = match phase.inner {
            InnerSamples::Pattern => {
                let measured = pattern.measure(&*self.tasks.materials[task], variation);
                let inner = measured.octets();
                let mut slopes = inner.no_slopes();
                let loss = found.compute(learner, &[&inner], &outer, Some(&mut slopes));
                by_pattern = measured.gradient_by_logits(&slopes);
                loss
            }
            InnerSamples::Fresh(count) | InnerSamples::Random(count) => {
                let lists = match phase.inner {
                    InnerSamples::Fresh(_) => learner.steps,
                    _ => 1,
                };
                let draws: Vec<Draw<'_>> = (0..lists)
                    .map(|_| pool.draw(task, variation, count, random))
                    .collect();
                let inner: Vec<_> = draws.iter().map(|draw| draw.octets().in_a_row()).collect();
                let inner: Vec<_> = inner.iter().collect();
                found.compute(learner, &inner, &outer, None)
            }
        };
        let gradients = Groups {
            initial: found.initial.iter().copied().collect(),
            step_sizes: found.step_sizes.iter().copied().collect(),
            pattern: by_pattern,
        };
        (loss, gradients)
    }

    /// The tasks of a batch: consecutive in an order that is shuffled anew each epoch.
    fn batch(&self, phase_index: usize, step: usize) -> Vec<usize> {
        let tasks = self.tasks.materials.len();
        let size = self.phases[phase_index].batch;
        let mut chosen = Vec::with_capacity(size);
        let mut shuffled: Option<(usize, Vec<usize>)> = None;
        for position in step * size..(step + 1) * size {
            let epoch = position / tasks;
            let order = match shuffled.take() {
                Some((of, order)) if of == epoch => order,
                _ => {
                    let mut order: Vec<usize> = (0..tasks).collect();
                    order.shuffle(&mut self.random(phase_index, epoch, 0));
                    order
                }
            };
            chosen.push(order[position % tasks]);
            shuffled = Some((epoch, order));
        }
        chosen
    }

    /// A generator of its own for each slot of each step: slot 0 orders tasks, the others draw.
    fn random(&self, phase: usize, step: usize, slot: usize) -> ChaCha8Rng {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream(((phase as u64) << 56) | ((slot as u64) << 40) | step as u64);
        random
    }
}

/// Scales a gradient down to [`LARGEST_NORM`]; one that is not finite becomes 0.
fn clip(gradient: &mut [f32]) {
    let norm = gradient
        .iter()
        .map(|value| value * value)
        .sum::<f32>()
        .sqrt();
    let scale = match norm {
        norm if !norm.is_finite() => {
            gradient.fill(0.0);
            return;
        }
        norm if norm > LARGEST_NORM => LARGEST_NORM / norm,
        _ => return,
    };
    for value in gradient {
        *value *= scale;
    }
}
