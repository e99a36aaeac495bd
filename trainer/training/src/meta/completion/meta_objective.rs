//! The parts of the schedule `prior`: initial values, the gradient of a step, and what happens between phases.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::hyperparameters::Hyperparameters;
use super::initial_weights::initial_weights;
use super::objective::{CHUNK, CompletionObjective, StepOptions};
use super::reading::Reading;
use super::refinement::Refinement;
use super::sample_order::greedy_order;
use super::task::Task;
use super::weighted_loss::{mean, weighted_mean};
use crate::linear::add_scaled;
use crate::meta::initialization::initial_guess;
use crate::meta::objective::LossEstimate;
use crate::meta::phase::{OuterStep, Values};

/// The initial precision of a component in the correction.
const INITIAL_PRECISION: f32 = 3.0;
/// The stride of the validation octets that are used to sort samples. A subset is accurate enough.
const ORDER_OCTET_STRIDE: usize = 8;
/// The number of draws of initial parameters that are compared.
const INITIAL_DRAWS: usize = 16;
/// The number of materials for their comparison.
const INITIAL_TASKS: usize = 32;
/// The random number stream of these draws.
const INITIAL_STREAM: u64 = u64::MAX - 100;

impl CompletionObjective<'_> {
    /// Returns the trained hyperparameters before training. A fold may have fewer components than an earlier run.
    fn initial_hyperparameters(&self) -> Vec<f32> {
        let components = self.subset.basis.components();
        let initial = Hyperparameters {
            steps: self.refinement.map(Refinement::initial_hyperparameters),
            precision: vec![INITIAL_PRECISION; components],
        };
        let initial = initial.encode();
        match self.earlier {
            Some(earlier) => earlier.hyperparameters[..initial.len()].to_vec(),
            None => initial,
        }
    }

    /// Returns initial meta-parameters. `guess` is the index of an independent initialization.
    #[must_use]
    pub fn initial_values(&self, guess: u64) -> Values {
        let mut random = ChaCha8Rng::seed_from_u64(self.streams.guess_seed(guess));
        let [coefficient_net, start_net] = initial_weights(self.shape, &mut random);
        let initial = match self.refinement {
            Some(refinement) => initial_guess(refinement.model(), &mut random),
            None => Vec::new(),
        };
        Values {
            hyperparameters: self.initial_hyperparameters(),
            initial,
            pattern: match self.earlier {
                Some(earlier) => earlier.pattern.clone(),
                None => self.streams.initial_pattern(guess, self.shape.samples),
            },
            coefficient_net,
            start_net,
        }
    }

    /// Returns meta-parameters, or their moments, with the samples in another order, given as indices. A list may be
    /// empty.
    #[must_use]
    pub fn permute_samples(&self, mut values: Values, order: &[usize]) -> Values {
        permute(&mut values.pattern, 3, order);
        permute(&mut values.coefficient_net, 3 * self.shape.rows(), order);
        values
    }

    /// Sorts samples by their importance, for scans that may end early: by the loss of the completed coefficients on the validation materials.
    ///
    /// With a budget for the time of a scan, the order is that of the path instead.
    #[must_use]
    pub fn reorder_samples(&self, values: Values) -> Values {
        if self.dataset.augmentation_options.missing_share == 0.0 || self.motion.is_some() {
            return values;
        }
        let prepared = self.prepare(&values, self.reachable_pattern(&values));
        let mut tasks = self.plain_tasks(&self.subset.validation);
        for task in &mut tasks {
            task.octets = task
                .octets
                .iter()
                .copied()
                .step_by(ORDER_OCTET_STRIDE)
                .collect();
        }
        let readings = tasks.par_iter().map(|task| self.read(&prepared, task));
        let readings: Vec<Vec<Reading>> = readings.collect();
        let order = greedy_order(self.shape.samples, |present| {
            for task in &mut tasks {
                task.present.copy_from_slice(present);
            }
            let chunks = tasks.par_chunks(CHUNK).zip(readings.par_chunks(CHUNK));
            let losses = chunks.flat_map_iter(|(tasks, readings)| {
                self.losses_from_readings(
                    &prepared,
                    tasks,
                    readings,
                    None,
                    self.validation_directions(),
                )
            });
            weighted_mean(&losses.collect::<Vec<_>>())
        });
        // Fixed samples come first, in their own order.
        let fixed = self.reach.fixed.len();
        let trained = order.into_iter().filter(|sample| *sample >= fixed);
        let order: Vec<usize> = (0..fixed).chain(trained).collect();
        self.permute_samples(values, &order)
    }

    /// Returns meta-parameters with the best of several draws of initial parameters. The losses after the fit differ by a factor of two between draws of Neural; Phong and Cook-Torrance
    /// have a single draw.
    #[must_use]
    pub fn choose_initial(&self, mut values: Values) -> Values {
        let Some(refinement) = self.refinement else {
            return values;
        };
        let stride = self.subset.validation.len().div_ceil(INITIAL_TASKS).max(1);
        let materials = self.subset.validation.iter().copied().step_by(stride);
        let mut tasks = self.plain_tasks(&materials.collect::<Vec<_>>());
        for task in &mut tasks {
            let octets = task.octets.iter().copied();
            task.octets = octets.step_by(ORDER_OCTET_STRIDE).collect();
        }
        let mut random = ChaCha8Rng::seed_from_u64(self.streams.seed);
        random.set_stream(INITIAL_STREAM);
        let mut best = (f32::INFINITY, values.initial.clone());
        for draw in 0..INITIAL_DRAWS {
            if draw > 0 {
                values.initial = initial_guess(refinement.model(), &mut random);
            }
            let prepared = self.prepare(&values, self.reachable_pattern(&values));
            let directions = self.validation_directions();
            let losses = self.losses(&prepared, &tasks, self.refinement, directions);
            let loss = weighted_mean(&losses);
            // Always false for NaN.
            if loss < best.0 {
                best = (loss, values.initial.clone());
            }
        }
        values.initial = best.1;
        values
    }

    /// Returns the weighted mean loss over a step's batch of tasks, and its gradient, which includes the
    /// [barrier](crate::meta::pattern::Pattern::barrier).
    #[must_use]
    pub fn gradient(
        &self,
        values: &Values,
        outer_step: OuterStep,
        options: StepOptions,
    ) -> (f32, Values) {
        let prepared = self.prepare(values, self.reach.pattern(&values.pattern));
        let tasks: Vec<Task> = (0..outer_step.batch)
            .map(|slot| {
                let mut random = self.streams.slot(outer_step, slot + 1);
                Task::random(
                    &self.dataset.pool,
                    &self.subset.groups,
                    &self.dataset.augmentation_options,
                    [self.shape.samples, options.outer_samples],
                    options.dropout,
                    &mut random,
                )
            })
            .collect();
        let refinement = self.refinement.filter(|_| options.is_refined);
        let chunks: Vec<_> = tasks
            .par_chunks(CHUNK)
            .map(|tasks| self.chunk_gradient(&prepared, tasks, refinement))
            .collect();
        let share = 1.0 / tasks.len() as f32;
        let mut loss = 0.0;
        let mut gradient = values.as_ref().map(|list| vec![0.0; list.len()]);
        let mut by_angles = vec![[0.0; 3]; self.shape.samples];
        for (chunk_loss, chunk_gradient, chunk_by_angles) in &chunks {
            loss += share * chunk_loss;
            for (sum, gradient) in gradient.each_mut().into_iter().zip(chunk_gradient.each()) {
                add_scaled(sum, share, gradient);
            }
            for (sum, derivatives) in by_angles.iter_mut().zip(chunk_by_angles) {
                add_scaled(sum, share, derivatives);
            }
        }
        gradient.pattern = prepared
            .pattern
            .gradient_by_logits(|sample| by_angles[sample]);
        (loss, gradient)
    }

    /// Returns the weighted mean loss of the completed coefficients on the validation materials, by which the best pattern
    /// is selected: the StartNet is trained only after the search. It is larger for patterns beyond a budget.
    #[must_use]
    pub fn selection_loss(&self, values: &Values) -> f32 {
        let factor = match &self.motion {
            Some(motion) => motion.selection_factor(&values.pattern),
            None => 1.0,
        };
        let prepared = self.prepare(values, self.reachable_pattern(values));
        let tasks = self.plain_tasks(&self.subset.validation);
        factor * weighted_mean(&self.losses(&prepared, &tasks, None, self.validation_directions()))
    }

    /// Returns the unweighted mean loss on the validation materials. For a fold they are unseen; otherwise they are the
    /// training materials at other directions.
    #[must_use]
    pub fn expected_loss(&self, values: &Values) -> LossEstimate {
        let losses = self.material_losses(values, &self.subset.validation);
        let losses = losses.iter().copied();
        LossEstimate::new(mean(losses.clone()), losses.map(f64::from))
    }
}

/// Reorders a list with `width` entries per sample.
fn permute(list: &mut [f32], width: usize, order: &[usize]) {
    let original = list.to_vec();
    let entries = order.iter().zip(list.chunks_exact_mut(width));
    for (sample, entry) in entries {
        entry.copy_from_slice(&original[sample * width..][..width]);
    }
}
