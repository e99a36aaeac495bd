//! The objectives of schedule paper, and the random number streams of all schedules.

use glimpse_materials::sampling::sobol_valid;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::pattern::logits_from_angles;
use super::phase::{OuterStep, Values};

/// The samples of the inner loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InnerSamples {
    /// A number of uniform samples, redrawn at every inner step.
    Fresh(usize),
    /// The samples of the pattern, the same at every inner step.
    Pattern,
}

/// The samples of a task's loss.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LossSamples {
    /// The samples of the inner loop.
    pub inner: InnerSamples,
    /// The number of samples of the outer loss.
    pub outer: usize,
}

/// A differentiable function of the meta-parameters of schedule paper, evaluated on batches of tasks.
pub trait PaperObjective: Sync {
    /// Returns initial meta-parameters.
    fn initial_values(&self) -> Values;

    /// Returns the mean outer loss over a step's batch of tasks, and its gradient. The gradient includes the
    /// [barrier](super::pattern::Pattern::barrier), the loss does not.
    fn gradient(
        &self,
        values: &Values,
        outer_step: OuterStep,
        samples: LossSamples,
    ) -> (f32, Values);

    /// Returns the mean loss on the validation materials: an estimate for an unseen material.
    fn expected_loss(&self, values: &Values) -> LossEstimate;
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
    pub fn slot(self, outer_step: OuterStep, slot: usize) -> ChaCha8Rng {
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
    pub fn batch(self, outer_step: OuterStep, tasks: usize) -> Vec<usize> {
        let size = outer_step.batch;
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
pub fn mean_gradient(tasks: &[(f32, Values)]) -> (f32, Values) {
    let share = 1.0 / tasks.len() as f32;
    let mut loss = 0.0;
    let mut sum = Values::default();
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
