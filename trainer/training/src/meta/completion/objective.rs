//! The loss of the schedule `prior` and its gradient over tasks: CoefficientNet, StartNet and pattern.

use glimpse_core::gonio::Limits;
use glimpse_core::section::MIN_PRECISION;
use glimpse_kernels::completion::{Batch, CompletionWeights, Shape};
use glimpse_kernels::components::ComponentTable;
use glimpse_kernels::lanes::{InstructionSet, Octet, OctetDirections, WIDTH};
use glimpse_kernels::samples::{OctetRgb, SampleOctets, SampleWeights};
use glimpse_optimizer::Groups;
use rayon::prelude::*;

use super::correction::{Corrected, Correction};
use super::dataset::{Dataset, Subset};
use super::pool::WarpedPool;
use super::reading::{PresentReadings, Reading, Standardization};
use super::refinement::{Refinement, RefinementGradient, RefinementInputs};
use super::task::Task;
use super::weighted_loss::WeightedLoss;
use crate::meta::objective::RandomStreams;
use crate::meta::pattern::{Pattern, reachable_angles};
use crate::meta::phase::StepSizeEncoding;
use crate::meta::plan::LossWeights;
use crate::meta::scan_budget::Motion;

/// The number of tasks that a thread processes together.
pub(super) const CHUNK: usize = 16;
/// The largest hyperparameter in a recipe.
const MAX_READING_WEIGHT: f32 = 1e4;
/// The encoding of the step sizes, which keeps them positive.
pub(super) const ENCODING: StepSizeEncoding = StepSizeEncoding::Logarithm;

/// The objective of schedule prior: the CoefficientNet alone for the model Linear, otherwise with the StartNet and its
/// descent.
pub struct CompletionObjective<'a> {
    /// The materials.
    pub dataset: &'a Dataset,
    /// The subset used by this run.
    pub subset: &'a Subset,
    /// The layer sizes of both networks.
    pub shape: Shape,
    /// The weighting of material losses.
    pub loss_weights: LossWeights,
    /// The random number streams.
    pub streams: RandomStreams,
    /// The fit after the StartNet; None for the model Linear.
    pub refinement: Option<&'a dyn Refinement>,
    /// The weight of the loss before the descent in the gradient, for models fitted by descent. The weight of the loss
    /// after the descent is 1.
    pub auxiliary_weight: f32,
    /// The limits of the goniometer.
    pub limits: Limits,
    /// The motion of a scan, if its time has a budget.
    pub motion: Option<Motion>,
    /// The values of an earlier run, whose pattern and hyperparameters a run starts with; None draws a pattern per guess.
    pub earlier: Option<&'a Groups<Vec<f32>>>,
}

/// The directions of the loss, and the components at them.
#[derive(Clone, Copy)]
pub(super) struct Directions<'a> {
    pool: &'a WarpedPool,
    table: &'a ComponentTable,
}

/// Meta-parameters, prepared for tasks.
pub(super) struct PreparedParameters<'v> {
    values: &'v Groups<Vec<f32>>,
    weights: CompletionWeights<'v>,
    pub(super) hyperparameters: Vec<f32>,
    pub(super) pattern: Pattern,
    pub(super) standardization: Standardization,
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

/// Returns the pool directions at which the loss of a task is evaluated.
fn octet_directions(pool: &WarpedPool, task: &Task) -> Vec<OctetDirections> {
    let directions = task.octets.iter();
    directions
        .map(|octet| pool.octet_directions[*octet as usize])
        .collect()
}

/// Returns samples of equal weight.
fn uniform_samples<'s>(
    directions: &'s [OctetDirections],
    values: &'s [OctetRgb],
) -> SampleOctets<'s> {
    let weight = Octet([uniform_weight(values.len()); WIDTH]);
    SampleOctets {
        at: directions,
        values,
        order: None,
        weights: SampleWeights::Mean([weight; 2]),
        instruction_set: InstructionSet::detect(),
        back_to_back: false,
    }
}

/// Returns the weight of each value in a mean over octets of directions.
fn uniform_weight(octets: usize) -> f32 {
    1.0 / (3 * WIDTH * octets) as f32
}

/// Returns the hyperparameters, within the range of recipes.
pub(super) fn hyperparameters(values: &Groups<Vec<f32>>) -> Vec<f32> {
    let list = ENCODING.decode(&values.hyperparameters).into_iter();
    list.map(|value| value.clamp(MIN_PRECISION, MAX_READING_WEIGHT))
        .collect()
}

/// sum += factor * vector
pub(super) fn add_scaled(sum: &mut [f32], factor: f32, vector: &[f32]) {
    for (entry, value) in sum.iter_mut().zip(vector) {
        *entry += factor * value;
    }
}

impl<'a> CompletionObjective<'a> {
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
    pub(super) fn reachable_pattern(&self, values: &Groups<Vec<f32>>) -> Pattern {
        Pattern::new(reachable_angles(&values.pattern, &self.limits))
    }

    pub(super) fn prepare<'v>(
        &self,
        values: &'v Groups<Vec<f32>>,
        pattern: Pattern,
    ) -> PreparedParameters<'v> {
        let hyperparameters = hyperparameters(values);
        let refinement = hyperparameters.len() - self.subset.basis.components();
        PreparedParameters {
            correction: Correction::new(
                &self.subset.basis,
                pattern.angles(),
                self.shape.components,
                &hyperparameters[refinement..],
            ),
            values,
            weights: CompletionWeights {
                shape: self.shape,
                coefficient_net: &values.coefficient_net,
                start_net: &values.start_net,
            },
            hyperparameters,
            standardization: Standardization::new(&self.subset.basis, pattern.angles()),
            pattern,
        }
    }

    /// Simulates all readings of a task, including missing ones.
    pub(super) fn read(&self, prepared: &PreparedParameters<'_>, task: &Task) -> Vec<Reading> {
        Reading::read_task(
            task,
            &self.dataset.materials,
            &self.dataset.augmentation_options,
            prepared.pattern.angles(),
            &prepared.standardization,
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
        let weight = self.loss_weights.weight(black) * task.reading_weight();
        let share = match refinement {
            Some(_) => self.auxiliary_weight,
            None => 1.0,
        };
        for derivative in &mut by_coefficients {
            *derivative *= share * weight;
        }
        let refined = refinement.map(|refinement| {
            let directions = octet_directions(pool, task);
            let inner = PresentReadings::new(readings, &completed.present[index]);
            let gradient = refinement.gradient(
                &RefinementInputs {
                    initial: &Self::initial_parameters(prepared, completed, index),
                    hyperparameters: &prepared.hyperparameters,
                    coefficients,
                    readings: &inner.octets(&prepared.pattern),
                    virtual_readings: &self.subset.virtual_readings,
                },
                &uniform_samples(&directions, &values),
            );
            add_scaled(&mut by_coefficients, weight, &gradient.coefficients);
            gradient
        });
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
    ) -> (f32, Groups<Vec<f32>>, Vec<[f32; 3]>) {
        let readings = self.read_all(prepared, tasks);
        let mut completed = self.complete(prepared, tasks, &readings);
        let mut loss = 0.0;
        let mut gradient = prepared.values.as_ref().map(|list| vec![0.0; list.len()]);
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
            add_scaled(
                &mut gradient.hyperparameters,
                weight,
                &refined.hyperparameters,
            );
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
            let precisions = gradient.hyperparameters.len() - correction.precision.len();
            let by_precision = &mut gradient.hyperparameters[precisions..];
            add_scaled(by_precision, 1.0, &correction.precision);
            for (sum, by_sample) in by_angles.iter_mut().zip(&correction.angles) {
                add_scaled(sum, 1.0, by_sample);
            }
            batch.set_coefficient_gradient(index, &correction.completed);
        }
        batch.adjoint(&prepared.weights, &mut gradient.coefficient_net);
        ENCODING.chain_rule(&mut gradient.hyperparameters, &prepared.hyperparameters);
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
            let weight = self.loss_weights.weight(black);
            let Some(refinement) = refinement else {
                return WeightedLoss { loss, weight };
            };
            let initial = Self::initial_parameters(prepared, &completed, index);
            let inner = PresentReadings::new(readings, &completed.present[index]);
            let parameters = refinement.fit(&RefinementInputs {
                initial: &initial,
                hyperparameters: &prepared.hyperparameters,
                coefficients,
                readings: &inner.octets(&prepared.pattern),
                virtual_readings: &self.subset.virtual_readings,
            });
            let loss_directions = octet_directions(directions.pool, task);
            let loss = refinement.loss(&parameters, &uniform_samples(&loss_directions, &values));
            WeightedLoss { loss, weight }
        });
        each.collect()
    }

    /// Returns the unweighted loss of tasks at the training directions.
    #[must_use]
    pub fn task_losses(&self, values: &Groups<Vec<f32>>, tasks: &[Task]) -> Vec<f32> {
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
    pub fn material_losses(&self, values: &Groups<Vec<f32>>, materials: &[usize]) -> Vec<f32> {
        self.validation_losses(values, &self.plain_tasks(materials))
    }

    /// Returns the unweighted loss of tasks at the validation directions.
    #[must_use]
    pub fn validation_losses(&self, values: &Groups<Vec<f32>>, tasks: &[Task]) -> Vec<f32> {
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
