//! The objective of schedule prior: the loss over tasks and its gradient by the CoefficientNet, the StartNet and the
//! pattern.

use glimpse_core::model::ModelKind;
use glimpse_kernels::completion::Shape;
use glimpse_kernels::lanes::WIDTH;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::completed_tasks::{CompletedTasks, Prepared, WeightedLoss, task_weight, weighted_mean};
use super::dataset::{Directions, Subset};
use super::gradient_sum::GradientSum;
use super::hyperparameters::Hyperparameters;
use super::initial_weights::initial_weights;
use super::refinement::{Refinement, RefinementGradient};
use super::sample_order::greedy_order;
use crate::linear::add_scaled;
use crate::meta::expected_loss::LossEstimate;
use crate::meta::initialization::initial_guess;
use crate::meta::pattern::{Pattern, Reach};
use crate::meta::phase::{OuterStep, Values, scaled_sum};
use crate::meta::scan_budget::Motion;
use crate::meta::streams::RandomStreams;
use crate::meta::tasks::reading::Reading;
use crate::meta::tasks::samples::uniform_weight;
use crate::meta::tasks::task::{Dropout, Task};

/// The number of tasks that a thread processes together.
pub(super) const CHUNK: usize = 16;
/// The number of directions of a task's loss. Twice as many do not lower the loss on other materials.
pub(super) const OUTER_SAMPLES: usize = 128;
/// The number of hidden units of the StartNet, g.
pub(super) const START_UNITS: usize = 32;
/// The initial precision of a component in the correction.
const INITIAL_PRECISION: f32 = 3.0;
/// The stride of the validation octets that are used to sort samples. A subset is accurate enough.
const ORDER_OCTET_STRIDE: usize = 8;
/// The number of materials for the comparison of initial parameters.
const INITIAL_TASKS: usize = 32;
/// The random number stream of initial parameters.
const INITIAL_STREAM: u64 = u64::MAX - 100;

/// The objective of schedule prior: the CoefficientNet alone for the model Linear, otherwise with the StartNet and its
/// refinement.
pub struct PriorObjective<'a> {
    /// The materials of this run.
    pub subset: &'a Subset<'a>,
    /// The layer sizes of both networks.
    pub shape: Shape,
    /// The random number streams.
    pub streams: RandomStreams,
    /// The refinement after the StartNet; None for the model Linear.
    pub refinement: Option<Refinement>,
    /// The weight of the loss before the refinement in the gradient. The weight of the loss after the refinement is 1.
    pub auxiliary_weight: f32,
    /// The directions that the pattern may have.
    pub reach: Reach<'a>,
    /// The motion of a scan, if its time has a budget.
    pub motion: Option<Motion>,
    /// The values of an earlier run, whose pattern and hyperparameters a run starts with; None draws a pattern per guess.
    pub earlier: Option<&'a Values>,
}

/// The gradient of one task.
struct TaskGradient {
    /// The weighted loss.
    loss: f32,
    /// The weight of the task.
    weight: f32,
    /// The gradient of the weighted loss with respect to the coefficients.
    coefficients: Vec<f32>,
    /// The unweighted loss after the refinement, with its gradient.
    refined: Option<RefinementGradient>,
}

/// The tasks of a step.
#[derive(Clone, Copy, Debug)]
pub struct StepOptions {
    /// The number of directions of a task's loss.
    pub outer_samples: usize,
    /// The distribution of missing readings.
    pub dropout: Dropout,
    /// True if the loss is that after the steps, false for that of the coefficients.
    pub is_refined: bool,
}

impl PriorObjective<'_> {
    /// Returns the model.
    #[must_use]
    pub fn model(&self) -> ModelKind {
        self.refinement.map_or(ModelKind::Linear, Refinement::model)
    }

    /// Returns the pattern of the recipe, within the limits.
    pub(super) fn reachable_pattern(&self, values: &Values) -> Pattern {
        self.reach.reachable_pattern(&values.pattern)
    }

    fn prepare<'v>(&'v self, values: &'v Values, pattern: Pattern) -> Prepared<'v> {
        Prepared::new(self.subset, self.shape, values, pattern)
    }

    /// Returns initial meta-parameters. `guess` is the index of an independent initialization. The earlier run may have
    /// more components.
    #[must_use]
    pub fn initial_values(&self, guess: u64) -> Values {
        let mut random = ChaCha8Rng::seed_from_u64(self.streams.guess_seed(guess));
        let [coefficient_net, start_net] = initial_weights(self.shape, &mut random);
        let initial = self
            .refinement
            .map(|refinement| initial_guess(refinement.model(), &mut random));
        let hyperparameters = Hyperparameters {
            steps: self.refinement.map(Refinement::initial_hyperparameters),
            precision: vec![INITIAL_PRECISION; self.subset.basis.components()],
        };
        let hyperparameters = hyperparameters.encode();
        let (hyperparameters, pattern) = match self.earlier {
            Some(earlier) => (
                earlier.hyperparameters[..hyperparameters.len()].to_vec(),
                earlier.pattern.clone(),
            ),
            None => (
                hyperparameters,
                self.streams.initial_pattern(guess, self.shape.samples),
            ),
        };
        Values {
            hyperparameters,
            initial: initial.unwrap_or_default(),
            pattern,
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

    /// Sorts samples by their importance, for scans that may end early: by the loss of the completed coefficients on the
    /// validation materials.
    ///
    /// With a budget for the time of a scan, the order is that of the path instead.
    #[must_use]
    pub fn reorder_samples(&self, values: Values) -> Values {
        let reading_options = &self.subset.dataset.reading_options;
        if reading_options.missing_share == 0.0 || self.motion.is_some() {
            return values;
        }
        let prepared = self.prepare(&values, self.reachable_pattern(&values));
        let mut tasks = self.plain_tasks(&self.subset.validation_materials, ORDER_OCTET_STRIDE);
        let readings = tasks.par_iter().map(|task| prepared.read(task));
        let readings: Vec<Vec<Reading>> = readings.collect();
        let order = greedy_order(self.shape.samples, |present| {
            for task in &mut tasks {
                task.present.copy_from_slice(present);
            }
            let chunks = tasks.par_chunks(CHUNK).zip(readings.par_chunks(CHUNK));
            let losses = chunks.flat_map_iter(|(tasks, readings)| {
                let completed = CompletedTasks::new(&prepared, tasks, readings);
                let loss = |index| completed.loss(index, None, &self.subset.validation);
                (0..tasks.len()).map(loss).collect::<Vec<_>>()
            });
            weighted_mean(&losses.collect::<Vec<_>>())
        });
        // Fixed samples come first, in their own order.
        let fixed = self.reach.fixed.len();
        let trained = order.into_iter().filter(|sample| *sample >= fixed);
        let order: Vec<usize> = (0..fixed).chain(trained).collect();
        self.permute_samples(values, &order)
    }

    /// Returns meta-parameters with the best of several draws of initial parameters. The losses after the fit differ by a
    /// factor of two between draws of Neural; Phong and Cook-Torrance have a single draw.
    #[must_use]
    pub fn choose_initial(&self, values: Values) -> Values {
        let Some(refinement) = self.refinement else {
            return values;
        };
        let all = &self.subset.validation_materials;
        let stride = all.len().div_ceil(INITIAL_TASKS).max(1);
        let materials: Vec<usize> = all.iter().copied().step_by(stride).collect();
        let tasks = self.plain_tasks(&materials, ORDER_OCTET_STRIDE);
        let mut random = ChaCha8Rng::seed_from_u64(self.streams.seed);
        random.set_stream(INITIAL_STREAM);
        refinement.choose_initial(values, &mut random, |values| {
            let directions = &self.subset.validation;
            weighted_mean(&self.losses(values, &tasks, self.refinement, directions))
        })
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
        let dataset = self.subset.dataset;
        let tasks: Vec<Task> = (0..outer_step.batch)
            .map(|slot| {
                Task::random(
                    &dataset.pool,
                    &self.subset.groups,
                    &dataset.reading_options,
                    [self.shape.samples, options.outer_samples],
                    options.dropout,
                    &mut self.streams.slot(outer_step, slot + 1),
                )
            })
            .collect();
        let refinement = self.refinement.filter(|_| options.is_refined);
        let chunks: Vec<_> = tasks
            .par_chunks(CHUNK)
            .map(|tasks| self.chunk_gradient(&prepared, tasks, refinement))
            .collect();
        let (loss, mut gradient) = scaled_sum(1.0 / tasks.len() as f32, &chunks);
        let (by_angles, _) = gradient.pattern.as_chunks();
        gradient.pattern = prepared
            .pattern
            .gradient_by_logits(|sample| by_angles[sample]);
        (loss, gradient)
    }

    /// Returns the loss of tasks and its gradient. That of the pattern is with respect to the angles.
    fn chunk_gradient(
        &self,
        prepared: &Prepared<'_>,
        tasks: &[Task],
        refinement: Option<Refinement>,
    ) -> (f32, Values) {
        let readings = prepared.read_all(tasks);
        let mut completed = CompletedTasks::new(prepared, tasks, &readings);
        let mut sum = GradientSum::new(prepared.values, &prepared.hyperparameters);
        let mut by_angles = vec![[0.0; 3]; self.shape.samples];
        let mut by_corrected = Vec::with_capacity(tasks.len());
        for index in 0..tasks.len() {
            let task = self.task_gradient(&completed, index, refinement);
            sum.loss += task.loss;
            by_corrected.push(task.coefficients);
            if let Some(refined) = task.refined {
                sum.add_refined(&mut completed.batch, index, task.weight, &refined);
                add_reading_gradient(&completed, index, task.weight, &refined, &mut by_angles);
            }
        }
        let CompletedTasks {
            mut batch,
            present,
            corrected,
            ..
        } = completed;
        if refinement.is_some() {
            for (index, by_corrected) in by_corrected.iter().enumerate() {
                batch.set_coefficient_gradient(index, by_corrected);
            }
            batch.start_net_adjoint(&prepared.weights, &mut sum.values.start_net);
            by_corrected = (0..tasks.len())
                .map(|index| batch.coefficient_gradient(index))
                .collect();
        }
        for (index, readings) in readings.iter().enumerate() {
            let correction = &prepared.correction;
            let gradient = correction.adjoint(&corrected[index], readings, &by_corrected[index]);
            add_scaled(&mut sum.hyperparameters.precision, 1.0, &gradient.precision);
            for (sum, by_sample) in by_angles.iter_mut().zip(&gradient.angles) {
                add_scaled(sum, 1.0, by_sample);
            }
            batch.set_coefficient_gradient(index, &gradient.completed);
        }
        batch.adjoint(&prepared.weights, &mut sum.values.coefficient_net);
        for (index, readings) in readings.iter().enumerate() {
            let gain = prepared.gain(&present[index]);
            let samples = readings.iter().zip(&present[index]).enumerate();
            for (sample, (reading, _)) in samples.filter(|(_, (_, present))| **present) {
                let by_reading = batch.by_reading(index, sample);
                for (by_value, dual) in by_reading.iter().zip(&reading.standardized) {
                    add_scaled(&mut by_angles[sample], gain * by_value, &dual.tangent);
                }
            }
        }
        sum.values.pattern = by_angles.into_flattened();
        sum.finish(&prepared.hyperparameters)
    }

    /// Returns the loss of one task, and its gradients.
    fn task_gradient(
        &self,
        completed: &CompletedTasks<'_>,
        index: usize,
        refinement: Option<Refinement>,
    ) -> TaskGradient {
        let Directions { pool, table } = &self.subset.training;
        let task = &completed.tasks[index];
        let values = task.values(pool);
        let coefficients = &completed.corrected[index].coefficients;
        let mut by_coefficients = vec![0.0; coefficients.len()];
        let [loss, black] = table.loss(
            coefficients,
            &task.octets,
            &values,
            uniform_weight(values.len()),
            Some(&mut by_coefficients),
        );
        let weight = task_weight(black) * task.reading_weight();
        let share = refinement.map_or(1.0, |_| self.auxiliary_weight);
        for derivative in &mut by_coefficients {
            *derivative *= share * weight;
        }
        let refined = refinement.zip(completed.inputs(index));
        let refined = refined
            .map(|(refinement, inputs)| refinement.gradient(&inputs, &task.samples(pool).octets()));
        if let Some(refined) = &refined {
            add_scaled(&mut by_coefficients, weight, &refined.coefficients);
        }
        TaskGradient {
            loss: weight * refined.as_ref().map_or(loss, |refined| refined.loss),
            weight,
            coefficients: by_coefficients,
            refined,
        }
    }

    /// Calls a function for each task, with the chunk of tasks that contains it and the index there.
    pub(super) fn map_tasks<T: Send>(
        &self,
        values: &Values,
        tasks: &[Task],
        function: impl Fn(&CompletedTasks<'_>, usize) -> T + Sync,
    ) -> Vec<T> {
        let prepared = self.prepare(values, self.reachable_pattern(values));
        let results = tasks.par_chunks(CHUNK).flat_map_iter(|tasks| {
            let readings = prepared.read_all(tasks);
            let completed = CompletedTasks::new(&prepared, tasks, &readings);
            let results = (0..tasks.len()).map(|index| function(&completed, index));
            results.collect::<Vec<T>>()
        });
        results.collect()
    }

    /// Returns the unweighted loss and the weight of each task at some directions.
    fn losses(
        &self,
        values: &Values,
        tasks: &[Task],
        refinement: Option<Refinement>,
        directions: &Directions<'_>,
    ) -> Vec<WeightedLoss> {
        self.map_tasks(values, tasks, |completed, index| {
            completed.loss(index, refinement, directions)
        })
    }

    /// Returns the weighted mean loss of the completed coefficients on the validation materials, by which the best pattern
    /// is selected: the StartNet is trained only after the search. It is larger for patterns beyond a budget.
    #[must_use]
    pub fn selection_loss(&self, values: &Values) -> f32 {
        let motion = self.motion.as_ref();
        let factor = motion.map_or(1.0, |motion| motion.selection_factor(&values.pattern));
        let tasks = self.plain_tasks(&self.subset.validation_materials, 1);
        factor * weighted_mean(&self.losses(values, &tasks, None, &self.subset.validation))
    }

    /// Returns the unweighted mean loss on the validation materials. For a fold they are unseen; otherwise they are the
    /// training materials at other directions.
    #[must_use]
    pub fn expected_loss(&self, values: &Values) -> LossEstimate {
        LossEstimate::of(&self.material_losses(values, &self.subset.validation_materials))
    }

    /// Returns the unweighted loss of materials at the validation directions, without augmentation.
    #[must_use]
    pub fn material_losses(&self, values: &Values, materials: &[usize]) -> Vec<f32> {
        let tasks = self.plain_tasks(materials, 1);
        self.task_losses(values, &tasks, &self.subset.validation)
    }

    /// Returns the unweighted loss of tasks at some directions.
    pub(super) fn task_losses(
        &self,
        values: &Values,
        tasks: &[Task],
        directions: &Directions<'_>,
    ) -> Vec<f32> {
        let losses = self.losses(values, tasks, self.refinement, directions);
        losses.iter().map(|task| task.loss).collect()
    }

    /// Returns tasks without augmentation, at every `stride`-th octet of validation directions.
    pub(super) fn plain_tasks(&self, materials: &[usize], stride: usize) -> Vec<Task> {
        let octets = self.subset.validation.pool.octet_count();
        let plain = |material: &usize| Task {
            octets: (0..octets as u32).step_by(stride).collect(),
            ..Task::plain(*material, self.shape.samples, 0)
        };
        materials.iter().map(plain).collect()
    }
}

/// Adds the gradient of a task's refinement with respect to the angles of the present samples: their directions and their
/// readings.
fn add_reading_gradient(
    completed: &CompletedTasks<'_>,
    index: usize,
    weight: f32,
    refined: &RefinementGradient,
    by_angles: &mut [[f32; 3]],
) {
    let pattern = &completed.prepared.pattern;
    for (sample, sum) in by_angles.iter_mut().enumerate() {
        if completed.present[index][sample] {
            let by_sample = pattern.gradient_by_angles(&refined.samples, sample);
            add_scaled(sum, weight, &by_sample);
            let by_octet = refined.samples[sample / WIDTH].measured;
            let slopes = completed.readings[index][sample].slopes;
            for (by_channel, slopes) in by_octet.iter().zip(&slopes) {
                add_scaled(sum, weight * by_channel.0[sample % WIDTH], slopes);
            }
        }
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
