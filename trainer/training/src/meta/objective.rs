//! What the outer loop trains, and its streams of random numbers.

use glimpse_materials::sampling::sobol_valid;
use glimpse_optimizer::Groups;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::pattern::logits_of;
use super::phase::{OuterStep, Phase};

/// What is meta-trained: how a batch of tasks changes with the meta-parameters.
pub trait MetaObjective: Sync {
    /// The meta-parameters that a first guess begins with.
    fn first_values(&self, guess: u64) -> Groups<Vec<f32>>;

    /// The same meta-parameters, the samples in the order in which they tell most of a material that is
    /// not read to the end; as they are where all of them are always read.
    fn in_order(&self, values: Groups<Vec<f32>>) -> Groups<Vec<f32>> {
        values
    }

    /// The mean outer loss over a step's batch of tasks, each weighed, and its gradient by the values
    /// (the gradient includes the [barrier](super::pattern::Pattern::barrier); the loss does not).
    fn gradient(&self, values: &Groups<Vec<f32>>, at: OuterStep<'_>) -> (f32, Groups<Vec<f32>>);

    /// The mean loss over all materials of training, each [weighed](super::plan::LossWeights), always
    /// at the same directions, and the barrier: what a phase of [evolution](super::evolution) goes
    /// by.
    fn fitness(&self, values: &Groups<Vec<f32>>, phase: &Phase) -> f32;

    /// The mean loss on the materials held out, each weighed: what is kept goes by it.
    fn judge(&self, values: &Groups<Vec<f32>>) -> f32;

    /// The mean loss on the materials held out as it is: what to expect of an unseen one.
    fn expected(&self, values: &Groups<Vec<f32>>) -> Expected;
}

/// The loss to expect on an unseen material, as it was found on some that stand for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expected {
    /// The mean loss.
    pub loss: f32,
    /// The standard error of that mean; None of a single material.
    pub standard_error: Option<f32>,
    /// On how many materials.
    pub materials: usize,
}

impl Expected {
    /// A mean loss, of these of single materials.
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

/// The random numbers of a run: a stream of its own for each task of each step, so that neither
/// threads nor a resumed run change what is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RandomStreams {
    /// The seed of all of them.
    pub seed: u64,
}

impl RandomStreams {
    /// The stream of a slot of a step: slot 0 orders tasks, task k of a batch draws from slot k + 1.
    #[must_use]
    pub fn slot(self, at: OuterStep<'_>, slot: usize) -> ChaCha8Rng {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream(((at.number as u64) << 56) | ((slot as u64) << 40) | at.step as u64);
        random
    }

    /// The logits of the pattern that a first guess begins with: Sobol points, scrambled anew for
    /// each guess.
    #[must_use]
    pub fn first_pattern(self, guess: u64, samples: usize) -> Vec<f32> {
        let seed = self.guess(guess);
        let pattern = sobol_valid(samples, (seed ^ (seed >> 32)) as u32);
        pattern.into_iter().flat_map(logits_of).collect()
    }

    /// The seed of a first guess.
    #[must_use]
    pub fn guess(self, guess: u64) -> u64 {
        self.seed.wrapping_add(guess << 32)
    }

    /// Which of so many tasks are in a step's batch: consecutive ones, in an order that is shuffled
    /// anew each epoch.
    #[must_use]
    pub fn batch(self, at: OuterStep<'_>, tasks: usize) -> Vec<usize> {
        let size = at.phase.batch;
        let mut chosen = Vec::with_capacity(size);
        let mut shuffled: Option<(usize, Vec<usize>)> = None;
        for position in at.step * size..(at.step + 1) * size {
            let epoch = position / tasks;
            let order = match shuffled.take() {
                Some((of, order)) if of == epoch => order,
                _ => {
                    let mut order: Vec<usize> = (0..tasks).collect();
                    let epoch = OuterStep { step: epoch, ..at };
                    order.shuffle(&mut self.slot(epoch, 0));
                    order
                }
            };
            chosen.push(order[position % tasks]);
            shuffled = Some((epoch, order));
        }
        chosen
    }
}

/// The mean of a batch's losses and gradients, summed in the batch's order, whichever thread was
/// first.
#[must_use]
pub fn mean(found: &[(f32, Groups<Vec<f32>>)]) -> (f32, Groups<Vec<f32>>) {
    let share = 1.0 / found.len() as f32;
    let mut loss = 0.0;
    let mut sum = Groups::<Vec<f32>>::default();
    for (task_loss, gradients) in found {
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
