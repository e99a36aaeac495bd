//! The objective of the outer loop, and its random number streams.

use glimpse_materials::sampling::sobol_valid;
use glimpse_optimizer::Groups;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::pattern::logits_from_angles;
use super::phase::{OuterStep, Phase};
use super::scan_budget::Motion;

/// A differentiable function of the meta-parameters, evaluated on batches of tasks.
pub trait MetaObjective: Sync {
    /// Returns initial meta-parameters. `guess` is the index of an independent initialization.
    fn initial_values(&self, guess: u64) -> Groups<Vec<f32>>;

    /// Returns the motion of a scan, if its time has a budget.
    fn motion(&self) -> Option<&Motion> {
        None
    }

    /// Returns meta-parameters, or their moments, with the samples in another order, given as indices. A list may be
    /// empty. By default, only the pattern depends on the order.
    fn permute_samples(&self, mut values: Groups<Vec<f32>>, order: &[usize]) -> Groups<Vec<f32>> {
        permute(&mut values.pattern, 3, order);
        values
    }

    /// Returns meta-parameters with the samples sorted by importance, for scans that may end early. By default, the
    /// order is kept.
    fn reorder_samples(&self, values: Groups<Vec<f32>>) -> Groups<Vec<f32>> {
        values
    }

    /// Returns meta-parameters with the best of several draws of initial parameters, given the other meta-parameters. By
    /// default, they are kept.
    fn choose_initial(&self, values: Groups<Vec<f32>>) -> Groups<Vec<f32>> {
        values
    }

    /// Returns the weighted mean outer loss over a step's batch of tasks, and its gradient. The gradient includes the
    /// [barrier](super::pattern::Pattern::barrier), the loss does not.
    fn gradient(
        &self,
        values: &Groups<Vec<f32>>,
        outer_step: OuterStep<'_>,
    ) -> (f32, Groups<Vec<f32>>);

    /// Returns the mean loss over all training materials, [weighted](super::plan::LossWeights) and at fixed directions,
    /// plus the barrier. Phases of [evolution](super::evolution) minimize it.
    fn fitness(&self, values: &Groups<Vec<f32>>, phase: &Phase) -> f32;

    /// Returns the weighted mean loss on the validation materials, by which the best meta-parameters are selected.
    fn validation_loss(&self, values: &Groups<Vec<f32>>) -> f32;

    /// Returns the unweighted mean loss on the validation materials: an estimate for an unseen material.
    fn expected_loss(&self, values: &Groups<Vec<f32>>) -> LossEstimate;
}

/// Reorders a list with `width` entries per sample.
pub(super) fn permute(list: &mut [f32], width: usize, order: &[usize]) {
    let original = list.to_vec();
    let entries = order.iter().zip(list.chunks_exact_mut(width));
    for (sample, entry) in entries {
        entry.copy_from_slice(&original[sample * width..][..width]);
    }
}

/// An estimate of the loss on an unseen material.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LossEstimate {
    /// The mean loss.
    pub loss: f32,
    /// The standard error of the mean; None for a single material.
    pub standard_error: Option<f32>,
    /// The number of materials.
    pub materials: usize,
}

impl LossEstimate {
    /// Creates an estimate from a mean loss and the losses of single materials.
    #[must_use]
    pub fn new(loss: f32, losses: impl ExactSizeIterator<Item = f64> + Clone) -> Self {
        let count = losses.len() as f64;
        let mean = losses.clone().sum::<f64>() / count;
        let squares: f64 = losses.map(|loss| (loss - mean).powi(2)).sum();
        let variance_of_mean = squares / (count - 1.0) / count;
        Self {
            loss,
            standard_error: (count > 1.0).then(|| variance_of_mean.sqrt() as f32),
            materials: count as usize,
        }
    }
}

/// The random number streams of a run, one for each task of each step. The numbers depend neither on threads nor on
/// interruptions of the run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RandomStreams {
    /// The seed of all streams.
    pub seed: u64,
}

impl RandomStreams {
    /// Returns the stream of a slot of a step. Slot 0 orders tasks; task k of a batch draws from slot k + 1.
    #[must_use]
    pub fn slot(self, outer_step: OuterStep<'_>, slot: usize) -> ChaCha8Rng {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream(
            ((outer_step.phase_index as u64) << 56)
                | ((slot as u64) << 40)
                | outer_step.step as u64,
        );
        random
    }

    /// Returns the logits of an initial pattern: Sobol points with a different scrambling for each guess.
    #[must_use]
    pub fn initial_pattern(self, guess: u64, samples: usize) -> Vec<f32> {
        let seed = self.guess_seed(guess);
        let pattern = sobol_valid(samples, (seed ^ (seed >> 32)) as u32);
        pattern.into_iter().flat_map(logits_from_angles).collect()
    }

    /// Returns the seed of an initialization.
    #[must_use]
    pub fn guess_seed(self, guess: u64) -> u64 {
        self.seed.wrapping_add(guess << 32)
    }

    /// Returns the tasks of a step's batch: consecutive entries of an order that is reshuffled each epoch.
    #[must_use]
    pub fn batch(self, outer_step: OuterStep<'_>, tasks: usize) -> Vec<usize> {
        let size = outer_step.phase.batch;
        let mut batch = Vec::with_capacity(size);
        let mut shuffled: Option<(usize, Vec<usize>)> = None;
        for position in outer_step.step * size..(outer_step.step + 1) * size {
            let epoch = position / tasks;
            let order = match shuffled.take() {
                Some((order_epoch, order)) if order_epoch == epoch => order,
                _ => {
                    let mut order: Vec<usize> = (0..tasks).collect();
                    let epoch = OuterStep {
                        step: epoch,
                        ..outer_step
                    };
                    order.shuffle(&mut self.slot(epoch, 0));
                    order
                }
            };
            batch.push(order[position % tasks]);
            shuffled = Some((epoch, order));
        }
        batch
    }
}

/// Returns the mean of a batch's losses and gradients, summed in the batch's order, independent of threads.
#[must_use]
pub fn mean_gradient(tasks: &[(f32, Groups<Vec<f32>>)]) -> (f32, Groups<Vec<f32>>) {
    let share = 1.0 / tasks.len() as f32;
    let mut loss = 0.0;
    let mut sum = Groups::<Vec<f32>>::default();
    for (task_loss, gradients) in tasks {
        loss += share * task_loss;
        for (sum, gradient) in sum.each_mut().into_iter().zip(gradients.each()) {
            sum.resize(gradient.len(), 0.0);
            for (sum, value) in sum.iter_mut().zip(gradient) {
                *sum += share * value;
            }
        }
    }
    (loss, sum)
}
