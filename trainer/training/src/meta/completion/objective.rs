//! The loss of the schedule `prior` and its gradient over tasks: CoefficientNet, StartNet and pattern.

use glimpse_core::model::ModelKind;
use glimpse_kernels::completion::{Batch, CompletionWeights, Shape};
use glimpse_kernels::components::ComponentTable;
use glimpse_kernels::lanes::WIDTH;
use rayon::prelude::*;

use super::correction::{Corrected, Correction};
use super::dataset::{Dataset, Subset};
use super::hyperparameters::Hyperparameters;
use super::pool::WarpedPool;
use super::reading::Reading;
use super::refinement::{Refinement, RefinementGradient, RefinementInputs};
use super::task::{Dropout, Task};
use super::weighted_loss::{WeightedLoss, task_weight};
use crate::linear::{ComponentsAt, add_scaled};
use crate::meta::objective::RandomStreams;
use crate::meta::pattern::{Pattern, Reach};
use crate::meta::phase::Values;
use crate::meta::samples::{WeightedSamples, uniform_weight};
use crate::meta::scan_budget::Motion;

/// The number of tasks that a thread processes together.
pub(super) const CHUNK: usize = 16;
/// The number of directions of a task's loss. Twice as many do not lower the loss on other materials.
pub const OUTER_SAMPLES: usize = 128;

/// The objective of schedule prior: the CoefficientNet alone for the model Linear, otherwise with the StartNet and its
/// descent.
pub struct CompletionObjective<'a> {
    /// The materials.
    pub dataset: &'a Dataset,
    /// The subset used by this run.
    pub subset: &'a Subset,
    /// The layer sizes of both networks.
    pub shape: Shape,
    /// The random number streams.
    pub streams: RandomStreams,
    /// The fit after the StartNet; None for the model Linear.
    pub refinement: Option<&'a dyn Refinement>,
    /// The weight of the loss before the descent in the gradient, for models fitted by descent. The weight of the loss
    /// after the descent is 1.
    pub auxiliary_weight: f32,
    /// The directions that the pattern may have.
    pub reach: Reach<'a>,
    /// The motion of a scan, if its time has a budget.
    pub motion: Option<Motion>,
    /// The values of an earlier run, whose pattern and hyperparameters a run starts with; None draws a pattern per guess.
    pub earlier: Option<&'a Values>,
}

/// The directions of the loss, and the components at them.
#[derive(Clone, Copy)]
pub(super) struct Directions<'a> {
    pool: &'a WarpedPool,
    table: &'a ComponentTable,
}

/// Meta-parameters, prepared for tasks.
pub(super) struct PreparedParameters<'v> {
    values: &'v Values,
    weights: CompletionWeights<'v>,
    pub(super) hyperparameters: Hyperparameters,
    pub(super) pattern: Pattern,
    pub(super) correction: Correction,
}

/// A batch of tasks with completed coefficients.
pub(super) struct CompletedBatch {
    batch: Batch,
    pub(super) present: Vec<Vec<bool>>,
    pub(super) corrected: Vec<Corrected>,
}

/// The result of one task.
struct TaskResult {
    /// The weighted loss.
    loss: f32,
    /// The weight of the task.
    weight: f32,
    by_coefficients: Vec<f32>,
    /// The unweighted loss after the descent, with its gradient.
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

impl<'a> CompletionObjective<'a> {
    /// Returns the model.
    #[must_use]
    pub fn model(&self) -> ModelKind {
        self.refinement
            .map_or(ModelKind::Linear, |refinement| refinement.model())
    }

    /// Returns the hyperparameters of meta-parameters.
    pub(super) fn hyperparameters(&self, values: &Values) -> Hyperparameters {
        Hyperparameters::decode(&values.hyperparameters, self.subset.basis.components())
    }

    fn training_directions(&self) -> Directions<'a> {
        Directions {
            pool: &self.dataset.pool,
            table: &self.subset.table,
        }
    }

    pub(super) fn validation_directions(&self) -> Directions<'a> {
        Directions {
            pool: &self.dataset.validation_pool,
            table: &self.subset.validation_table,
        }
    }

    /// Returns the pattern of the recipe, within the limits.
    pub(super) fn reachable_pattern(&self, values: &Values) -> Pattern {
        self.reach.reachable_pattern(&values.pattern)
    }

    pub(super) fn prepare<'v>(
        &self,
        values: &'v Values,
        pattern: Pattern,
    ) -> PreparedParameters<'v> {
        let hyperparameters = self.hyperparameters(values);
        let at = ComponentsAt::new(&self.subset.basis, pattern.angles().to_vec());
        PreparedParameters {
            correction: Correction::new(at, self.shape.components, &hyperparameters.precision),
            values,
            weights: CompletionWeights {
                shape: self.shape,
                coefficient_net: &values.coefficient_net,
                start_net: &values.start_net,
            },
            hyperparameters,
            pattern,
        }
    }

    /// Simulates all readings of a task, including missing ones.
    pub(super) fn read(&self, prepared: &PreparedParameters<'_>, task: &Task) -> Vec<Reading> {
        Reading::read_task(
            task,
            &self.dataset.materials,
            &self.dataset.augmentation_options,
            &prepared.correction.at,
        )
    }

    pub(super) fn read_all(
        &self,
        prepared: &PreparedParameters<'_>,
        tasks: &[Task],
    ) -> Vec<Vec<Reading>> {
        tasks.iter().map(|task| self.read(prepared, task)).collect()
    }

    /// Returns the dropout gain of the present readings.
    fn gain(&self, present: &[bool]) -> f32 {
        let missing = self.dataset.augmentation_options.missing_policy();
        missing.dropout_gain(present.iter().copied())
    }

    /// Computes the coefficients of tasks from their readings.
    pub(super) fn complete(
        &self,
        prepared: &PreparedParameters<'_>,
        tasks: &[Task],
        readings: &[Vec<Reading>],
    ) -> CompletedBatch {
        let mut batch = Batch::new(self.shape, tasks.len());
        let mut present_readings = Vec::with_capacity(tasks.len());
        for (index, (task, readings)) in tasks.iter().zip(readings).enumerate() {
            let present = task.present.iter().zip(prepared.pattern.valid());
            let present: Vec<bool> = present.map(|(present, valid)| *present && *valid).collect();
            let gain = self.gain(&present);
            for (sample, reading) in readings.iter().enumerate() {
                let values = reading.standardized.map(|dual| gain * dual.value);
                batch.set_reading(index, sample, present[sample].then_some(values));
            }
            present_readings.push(present);
        }
        batch.complete(&prepared.weights);
        let each = readings.iter().zip(&present_readings).enumerate();
        let corrected = each.map(|(index, (readings, present))| {
            let completed = batch.coefficients(index);
            prepared.correction.correct(readings, present, &completed)
        });
        let corrected: Vec<Corrected> = corrected.collect();
        if self.refinement.is_some() {
            for (index, corrected) in corrected.iter().enumerate() {
                batch.set_coefficients(index, &corrected.coefficients);
            }
            batch.activate(&prepared.weights);
        }
        CompletedBatch {
            corrected,
            batch,
            present: present_readings,
        }
    }

    /// Returns theta_0 of a task: the shared initial parameters plus the output of the StartNet.
    pub(super) fn initial_parameters(
        prepared: &PreparedParameters<'_>,
        completed: &CompletedBatch,
        index: usize,
    ) -> Vec<f32> {
        let mut initial = completed.batch.offsets(index);
        add_scaled(&mut initial, 1.0, &prepared.values.initial);
        initial
    }

    /// Calls a function with the inputs of a task's refinement.
    pub(super) fn with_inputs<T>(
        &self,
        (prepared, completed, readings): (&PreparedParameters<'_>, &CompletedBatch, &[Reading]),
        index: usize,
        function: impl FnOnce(&RefinementInputs<'_>) -> T,
    ) -> Option<T> {
        let hyperparameters = prepared.hyperparameters.steps.as_ref()?;
        let brdf: Vec<[f32; 3]> = readings.iter().map(|reading| reading.brdf).collect();
        let directions = prepared.pattern.octet_directions();
        let present = WeightedSamples::present(directions, &brdf, &completed.present[index]);
        Some(function(&RefinementInputs {
            initial: &Self::initial_parameters(prepared, completed, index),
            hyperparameters,
            coefficients: &completed.corrected[index].coefficients,
            readings: &present.octets(),
            virtual_readings: &self.subset.virtual_readings,
        }))
    }

    /// Returns the loss of one task, and its gradients.
    fn task_result(
        &self,
        prepared: &PreparedParameters<'_>,
        completed: &CompletedBatch,
        readings: &[Reading],
        index: usize,
        task: &Task,
        refinement: Option<&dyn Refinement>,
    ) -> TaskResult {
        let Directions { pool, table } = self.training_directions();
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
        let share = match refinement {
            Some(_) => self.auxiliary_weight,
            None => 1.0,
        };
        for derivative in &mut by_coefficients {
            *derivative *= share * weight;
        }
        let refined = refinement.and_then(|refinement| {
            self.with_inputs((prepared, completed, readings), index, |inputs| {
                refinement.gradient(inputs, &task.samples(pool).octets())
            })
        });
        if let Some(refined) = &refined {
            add_scaled(&mut by_coefficients, weight, &refined.coefficients);
        }
        TaskResult {
            loss: weight * refined.as_ref().map_or(loss, |refined| refined.loss),
            weight,
            by_coefficients,
            refined,
        }
    }

    /// Returns the loss of tasks and its gradient. The gradient of the pattern is separate, with respect to the angles.
    pub(super) fn chunk_gradient(
        &self,
        prepared: &PreparedParameters<'_>,
        tasks: &[Task],
        refinement: Option<&dyn Refinement>,
    ) -> (f32, Values, Vec<[f32; 3]>) {
        let readings = self.read_all(prepared, tasks);
        let mut completed = self.complete(prepared, tasks, &readings);
        let mut loss = 0.0;
        let mut gradient = prepared.values.as_ref().map(|list| vec![0.0; list.len()]);
        let mut by_hyperparameters = prepared.hyperparameters.zeros();
        let mut by_angles = vec![[0.0; 3]; self.shape.samples];
        let mut by_corrected = Vec::with_capacity(tasks.len());
        for (index, (task, readings)) in tasks.iter().zip(&readings).enumerate() {
            let result = self.task_result(prepared, &completed, readings, index, task, refinement);
            loss += result.loss;
            let batch = &mut completed.batch;
            if refinement.is_some() {
                batch.set_coefficient_gradient(index, &result.by_coefficients);
            }
            by_corrected.push(result.by_coefficients);
            let (weight, Some(refined)) = (result.weight, result.refined) else {
                continue;
            };
            add_scaled(&mut gradient.initial, weight, &refined.initial);
            if let Some(by_steps) = &mut by_hyperparameters.steps {
                by_steps.add_scaled(weight, &refined.hyperparameters);
            }
            batch.set_offset_gradient(
                index,
                refined.initial.iter().map(|derivative| weight * derivative),
            );
            for (sample, sum) in by_angles.iter_mut().enumerate() {
                if completed.present[index][sample] {
                    let by_sample = prepared
                        .pattern
                        .gradient_by_angles(&refined.samples, sample);
                    add_scaled(sum, weight, &by_sample);
                    let by_octet = refined.samples[sample / WIDTH].measured;
                    for (by_channel, slopes) in by_octet.iter().zip(&readings[sample].slopes) {
                        add_scaled(sum, weight * by_channel.0[sample % WIDTH], slopes);
                    }
                }
            }
        }
        let CompletedBatch {
            mut batch,
            present,
            corrected,
        } = completed;
        if refinement.is_some() {
            batch.start_net_adjoint(&prepared.weights, &mut gradient.start_net);
            for (index, by_corrected) in by_corrected.iter_mut().enumerate() {
                *by_corrected = batch.coefficient_gradient(index);
            }
        }
        for (index, readings) in readings.iter().enumerate() {
            let correction =
                prepared
                    .correction
                    .adjoint(&corrected[index], readings, &by_corrected[index]);
            add_scaled(
                &mut by_hyperparameters.precision,
                1.0,
                &correction.precision,
            );
            for (sum, by_sample) in by_angles.iter_mut().zip(&correction.angles) {
                add_scaled(sum, 1.0, by_sample);
            }
            batch.set_coefficient_gradient(index, &correction.completed);
        }
        batch.adjoint(&prepared.weights, &mut gradient.coefficient_net);
        gradient.hyperparameters = prepared.hyperparameters.by_logarithms(&by_hyperparameters);
        for (index, readings) in readings.iter().enumerate() {
            let gain = self.gain(&present[index]);
            let samples = readings.iter().zip(&present[index]).enumerate();
            for (sample, (reading, _)) in samples.filter(|(_, (_, present))| **present) {
                let by_reading = batch.by_reading(index, sample);
                for (by_value, dual) in by_reading.iter().zip(&reading.standardized) {
                    add_scaled(&mut by_angles[sample], gain * by_value, &dual.tangent);
                }
            }
        }
        (loss, gradient, by_angles)
    }

    /// Returns the unweighted loss and the weight of each task. The loss is that of the parameters after the descent,
    /// or of the completed coefficients without `refinement`.
    pub(super) fn losses(
        &self,
        prepared: &PreparedParameters<'_>,
        tasks: &[Task],
        refinement: Option<&dyn Refinement>,
        directions: Directions<'_>,
    ) -> Vec<WeightedLoss> {
        let evaluate_chunk = |tasks: &[Task]| {
            let readings = self.read_all(prepared, tasks);
            self.losses_from_readings(prepared, tasks, &readings, refinement, directions)
        };
        tasks
            .par_chunks(CHUNK)
            .flat_map_iter(evaluate_chunk)
            .collect()
    }

    /// Returns the same as [`CompletionObjective::losses`], for given readings.
    pub(super) fn losses_from_readings(
        &self,
        prepared: &PreparedParameters<'_>,
        tasks: &[Task],
        readings: &[Vec<Reading>],
        refinement: Option<&dyn Refinement>,
        directions: Directions<'_>,
    ) -> Vec<WeightedLoss> {
        let completed = self.complete(prepared, tasks, readings);
        let each = tasks.iter().zip(readings).enumerate();
        let each = each.map(|(index, (task, readings))| {
            let values = task.values(directions.pool);
            let coefficients = &completed.corrected[index].coefficients;
            let value_weight = uniform_weight(values.len());
            let [loss, black] =
                directions
                    .table
                    .loss(coefficients, &task.octets, &values, value_weight, None);
            let weight = task_weight(black);
            let refined = refinement.and_then(|refinement| {
                self.with_inputs((prepared, &completed, readings), index, |inputs| {
                    let parameters = refinement.fit(inputs);
                    refinement.loss(&parameters, &task.samples(directions.pool).octets())
                })
            });
            let loss = refined.unwrap_or(loss);
            WeightedLoss { loss, weight }
        });
        each.collect()
    }

    /// Returns the unweighted loss of tasks at the training directions.
    #[must_use]
    pub fn task_losses(&self, values: &Values, tasks: &[Task]) -> Vec<f32> {
        let prepared = self.prepare(values, self.reachable_pattern(values));
        let losses = self.losses(
            &prepared,
            tasks,
            self.refinement,
            self.training_directions(),
        );
        losses.iter().map(|each| each.loss).collect()
    }

    /// Returns the unweighted loss of training materials at the validation directions, without augmentation.
    #[must_use]
    pub fn material_losses(&self, values: &Values, materials: &[usize]) -> Vec<f32> {
        self.validation_losses(values, &self.plain_tasks(materials))
    }

    /// Returns the unweighted loss of tasks at the validation directions.
    #[must_use]
    pub fn validation_losses(&self, values: &Values, tasks: &[Task]) -> Vec<f32> {
        let prepared = self.prepare(values, self.reachable_pattern(values));
        let losses = self.losses(
            &prepared,
            tasks,
            self.refinement,
            self.validation_directions(),
        );
        losses.iter().map(|each| each.loss).collect()
    }

    /// Returns tasks without augmentation, at all validation directions.
    #[must_use]
    pub fn plain_tasks(&self, materials: &[usize]) -> Vec<Task> {
        let octets = self.validation_directions().pool.octet_count();
        let plain = |material: &usize| Task::plain(*material, self.shape.samples, octets);
        materials.iter().map(plain).collect()
    }
}
