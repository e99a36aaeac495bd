//! The random numbers of a run.

use glimpse_materials::sampling::{random_stream, sobol_valid};
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::outer::OuterStep;
use super::pattern::Reach;

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
        let indices = [outer_step.phase_index, slot, outer_step.step];
        let [phase, slot, step] = indices.map(|index| index as u64);
        random_stream(self.seed, (phase << 56) | (slot << 40) | step)
    }

    /// Returns the logits of an initial pattern: Sobol points with a different scrambling for each guess.
    #[must_use]
    pub fn initial_pattern(self, guess: u64, samples: usize) -> Vec<f32> {
        let seed = self.guess_seed(guess);
        let pattern = sobol_valid(samples, (seed ^ (seed >> 32)) as u32);
        pattern
            .into_iter()
            .flat_map(|at| Reach::ANY.logits(at))
            .collect()
    }

    /// Returns the seed of an initialization.
    #[must_use]
    pub fn guess_seed(self, guess: u64) -> u64 {
        self.seed.wrapping_add(guess << 32)
    }

    /// Returns the tasks of a step's batch: consecutive entries of an order that is reshuffled each epoch.
    #[must_use]
    pub fn batch(self, outer_step: OuterStep, tasks: usize) -> Vec<usize> {
        let first = outer_step.step * outer_step.batch;
        let positions = first..first + outer_step.batch;
        let mut batch = Vec::with_capacity(outer_step.batch);
        for step in positions.start / tasks..positions.end.div_ceil(tasks) {
            let epoch = OuterStep { step, ..outer_step };
            let mut order: Vec<usize> = (0..tasks).collect();
            order.shuffle(&mut self.slot(epoch, 0));
            let start = positions.start.max(step * tasks);
            let end = positions.end.min((step + 1) * tasks);
            batch.extend((start..end).map(|position| order[position % tasks]));
        }
        batch
    }
}
