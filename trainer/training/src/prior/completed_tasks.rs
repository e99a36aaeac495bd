//! Tasks from their readings to their losses: coefficients, the evidence of the readings, losses, and their gradient.

use glimpse_core::fit::coefficient_net::dropout_gain;
use glimpse_fitting::linear::bounded_precision;
use glimpse_kernels::ModelKernels;
use glimpse_kernels::completion::{
    Batch, CompletionWeights, activate, coefficient_net_adjoint, complete, start_net_adjoint,
};
use glimpse_kernels::components::component_loss;
use glimpse_kernels::lanes::WIDTH;
use glimpse_kernels::samples::SampleOctets;
use glimpse_materials::lists::add_scaled;

use super::dataset::{LossDirections, Subset};
use super::hyperparameters::Hyperparameters;
use super::refinement::{self, RefinementGradient, RefinementInputs};
use crate::correction::{Corrected, Correction};
use crate::loss_predictor::LossEvidence;
use crate::outer::MetaValues;
use crate::pattern::SamplePattern;
use crate::tasks::reading::TaskReading;
use crate::tasks::samples::{WeightedSamples, uniform_weight};
use crate::tasks::task::TrainingTask;

/// The loss of a task, with its weight.
#[derive(Clone, Copy)]
pub(super) struct WeightedLoss {
    pub(super) loss: f32,
    pub(super) weight: f32,
}

/// Returns the weight of a task's loss, given the loss of black (f = 0) on its material, to which it is about inverse: the
/// loss of a dark material is always small, but its errors are visible in pictures.
pub(super) fn task_weight(loss_of_black: f32) -> f32 {
    /// Limits the weight of a black material to (`MEAN` + `OFFSET`) / `OFFSET` = 13.
    const OFFSET: f32 = 0.005;
    /// The approximate mean loss of black over materials, so that a typical weight is 1.
    const MEAN: f32 = 0.06;
    (MEAN + OFFSET) / (loss_of_black + OFFSET)
}

/// Returns the mean of the products of losses and weights.
pub(super) fn weighted_mean(losses: &[WeightedLoss]) -> f32 {
    let products = losses.iter().map(|task| task.weight * task.loss);
    products.sum::<f32>() / losses.len() as f32
}

/// Meta-parameters, prepared for tasks.
pub(super) struct Prepared<'v> {
    pub(super) subset: &'v Subset<'v>,
    pub(super) values: &'v MetaValues,
    pub(super) weights: CompletionWeights<'v>,
    pub(super) hyperparameters: Hyperparameters,
    pub(super) pattern: SamplePattern,
    pub(super) correction: Correction,
    /// The precisions of the ridge fit at [random directions](super::objective::PriorObjective::random_directions).
    pub(super) random_directions: Option<[&'v [f32]; 2]>,
    /// The weight of the loss before the refinement.
    pub(super) auxiliary_weight: f32,
}

impl Prepared<'_> {
    /// Simulates all readings of a task, including missing ones.
    pub(super) fn read(&self, task: &TrainingTask) -> Vec<TaskReading> {
        let dataset = self.subset.dataset;
        let levels = dataset.reading_options.noise.levels;
        TaskReading::read_task(task, &dataset.materials, levels, &self.correction.at)
    }

    /// Simulates all readings of tasks.
    pub(super) fn read_all(&self, tasks: &[TrainingTask]) -> Vec<Vec<TaskReading>> {
        tasks.iter().map(|task| self.read(task)).collect()
    }

    /// Returns the dropout gain of the present readings.
    pub(super) fn gain(&self, present: &[bool]) -> f32 {
        let options = &self.subset.dataset.reading_options;
        dropout_gain(options.tolerates_missing(), present.iter().copied())
    }
}

/// Tasks with completed coefficients.
pub(super) struct CompletedTasks<'a> {
    pub(super) prepared: &'a Prepared<'a>,
    pub(super) tasks: &'a [TrainingTask],
    pub(super) readings: &'a [Vec<TaskReading>],
    pub(super) batch: Batch,
    pub(super) present: Vec<Vec<bool>>,
    pub(super) corrected: Vec<Corrected>,
}

impl<'a> CompletedTasks<'a> {
    /// Computes the coefficients of tasks from their readings, and the outputs of the StartNet, if there is one.
    pub(super) fn new(
        prepared: &'a Prepared<'a>,
        tasks: &'a [TrainingTask],
        readings: &'a [Vec<TaskReading>],
    ) -> Self {
        let present = tasks.iter().map(|task| {
            let present = task.present.iter().zip(&prepared.pattern.valid);
            present.map(|(present, valid)| *present && *valid).collect()
        });
        let mut completed = Self {
            prepared,
            tasks,
            readings,
            batch: Batch::new(prepared.weights.shape, tasks.len()),
            present: present.collect(),
            corrected: Vec::new(),
        };
        completed.corrected = match prepared.random_directions {
            Some(precision) => completed.ridge(precision),
            None => completed.complete(),
        };
        if prepared.weights.shape.parameters > 0 {
            for (index, corrected) in completed.corrected.iter().enumerate() {
                let batch = &mut completed.batch;
                batch.set_coefficients(index, &corrected.coefficients);
            }
            activate(&mut completed.batch, &prepared.weights);
        }
        completed
    }

    /// Computes coefficients by the CoefficientNet, and corrects them.
    fn complete(&mut self) -> Vec<Corrected> {
        let (prepared, batch) = (self.prepared, &mut self.batch);
        for (index, (present, readings)) in self.present.iter().zip(self.readings).enumerate() {
            let gain = prepared.gain(present);
            for (sample, reading) in readings.iter().enumerate() {
                let values = reading.standardized.map(|dual| gain * dual.value);
                batch.set_reading(index, sample, present[sample].then_some(values));
            }
        }
        complete(batch, &prepared.weights);
        let tasks = self.readings.iter().zip(&self.present).enumerate();
        let corrected = tasks.map(|(index, (readings, present))| {
            let completed = batch.coefficients(index);
            prepared.correction.correct(readings, present, &completed)
        });
        corrected.collect()
    }

    /// Computes coefficients by a ridge fit to all readings.
    fn ridge(&self, precision: [&[f32]; 2]) -> Vec<Corrected> {
        let at = &self.prepared.correction.at;
        let [mean, difference] = precision.map(|precision| bounded_precision(&at.rows, precision));
        let coefficients = self.readings.iter().map(|readings| {
            let brdf = TaskReading::brdf(readings);
            at.fit_channels([&mean, &difference], &brdf)
        });
        coefficients.map(Corrected::estimated).collect()
    }

    /// Returns the inputs of a task's refinement; None for the model Linear. The initial parameters are the shared ones
    /// plus the output of the StartNet.
    pub(super) fn inputs(&self, index: usize) -> Option<RefinementInputs<'_>> {
        let prepared = self.prepared;
        let hyperparameters = prepared.hyperparameters.steps.as_ref()?;
        let mut initial = self.batch.offsets(index);
        add_scaled(&mut initial, 1.0, &prepared.values.initial);
        let directions = &prepared.pattern.octet_directions;
        let brdf = TaskReading::brdf(&self.readings[index]);
        Some(RefinementInputs {
            initial,
            hyperparameters,
            coefficients: &self.corrected[index].coefficients,
            readings: WeightedSamples::present(directions, &brdf, &self.present[index]),
            virtual_readings: &prepared.subset.virtual_readings,
        })
    }

    /// Returns the unweighted loss and the weight of a task. The loss is that of the parameters after the refinement, or
    /// of the completed coefficients without.
    pub(super) fn loss(
        &self,
        index: usize,
        refinement: Option<&'static ModelKernels>,
        directions: &LossDirections<'_>,
    ) -> WeightedLoss {
        let task = &self.tasks[index];
        let values = task.values(directions.pool);
        let [loss, black] = component_loss(
            &directions.table,
            &self.corrected[index].coefficients,
            &task.octets,
            &values,
            uniform_weight(values.len()),
            None,
        );
        let refined = refinement.zip(self.inputs(index));
        let refined = refined.map(|(kernels, inputs)| {
            refinement::loss(kernels, &inputs, &task.samples(directions.pool).octets())
        });
        WeightedLoss {
            loss: refined.unwrap_or(loss),
            weight: task_weight(black),
        }
    }

    /// Returns the innovation of a task's readings, and the mean residual of its fit at them.
    pub(super) fn evidence(
        &self,
        index: usize,
        refinement: Option<&'static ModelKernels>,
    ) -> LossEvidence {
        let (present, corrected) = (&self.present[index], &self.corrected[index]);
        let refined = refinement.zip(self.inputs(index));
        let refined = refined
            .map(|(kernels, inputs)| refinement::loss(kernels, &inputs, &inputs.readings.octets()));
        LossEvidence {
            innovation: corrected.innovation(present),
            residual: refined.unwrap_or_else(|| self.residual(index)),
        }
    }

    /// Returns the mean residual of the completed coefficients at the readings.
    fn residual(&self, index: usize) -> f32 {
        let present = &self.present[index];
        let at = &self.prepared.correction.at;
        let count = present.iter().filter(|present| **present).count().max(1);
        let readings = self.readings[index].iter().enumerate();
        let errors = readings.filter(|(sample, _)| present[*sample]);
        let errors = errors.map(|(sample, reading)| {
            let modeled = at.brdf(sample, &self.corrected[index].coefficients);
            let cosine = at.cos_theta_i[sample];
            let channels = modeled.iter().zip(&reading.brdf);
            channels
                .map(|(f, y)| ((1.0 + f * cosine) / (1.0 + y * cosine)).ln().abs())
                .sum::<f32>()
        });
        errors.sum::<f32>() / (3 * count) as f32
    }

    /// Returns the coefficients of a task that the net completes, averaged over channels.
    pub(super) fn mean_coefficients(&self, index: usize) -> Vec<f32> {
        let all = &self.corrected[index].coefficients;
        let components = all.len() / 3;
        let mean = |k| (all[k] + all[components + k] + all[2 * components + k]) / 3.0;
        (0..self.prepared.weights.shape.components)
            .map(mean)
            .collect()
    }
}

/// The sum of losses of tasks, and its gradient.
struct ChunkGradient<'a> {
    tasks: CompletedTasks<'a>,
    loss: f32,
    /// The gradient of all groups but the hyperparameters and the pattern.
    values: MetaValues,
    hyperparameters: Hyperparameters,
    /// The gradient with respect to the angles of each sample; empty at random directions.
    angles: Vec<[f32; 3]>,
}

/// Returns the weighted sum of the losses of tasks, and its gradient. That of the pattern is with respect to the angles.
pub(super) fn chunk_gradient(
    prepared: &Prepared<'_>,
    tasks: &[TrainingTask],
    refinement: Option<&'static ModelKernels>,
) -> (f32, MetaValues) {
    let readings = prepared.read_all(tasks);
    let mut sum = ChunkGradient {
        tasks: CompletedTasks::new(prepared, tasks, &readings),
        loss: 0.0,
        values: prepared.values.map(|list| vec![0.0; list.len()]),
        hyperparameters: prepared.hyperparameters.zeros(),
        angles: vec![[0.0; 3]; prepared.weights.shape.samples],
    };
    let by_coefficients = (0..tasks.len()).map(|index| sum.add_task(index, refinement));
    let mut by_coefficients: Vec<Vec<f32>> = by_coefficients.collect();
    if refinement.is_some() {
        by_coefficients = sum.start_net_adjoint(&by_coefficients);
    }
    if prepared.random_directions.is_none() {
        sum.coefficient_adjoint(&by_coefficients);
        sum.values.pattern = sum.angles.into_flattened();
    }
    sum.values.hyperparameters = prepared.hyperparameters.by_logarithms(&sum.hyperparameters);
    (sum.loss, sum.values)
}

impl ChunkGradient<'_> {
    /// Adds the loss of a task, and its gradient with respect to all but the nets. Returns the gradient with respect to the
    /// coefficients, without that by way of the StartNet.
    fn add_task(&mut self, index: usize, refinement: Option<&'static ModelKernels>) -> Vec<f32> {
        let prepared = self.tasks.prepared;
        let LossDirections { pool, table } = &prepared.subset.training;
        let task = &self.tasks.tasks[index];
        let outer = task.samples(pool);
        let outer = outer.octets();
        let coefficients = &self.tasks.corrected[index].coefficients;
        let mut by_coefficients = vec![0.0; coefficients.len()];
        let (loss, weight) = if prepared.random_directions.is_some() {
            (0.0, task_weight(loss_of_black(&outer)))
        } else {
            let [loss, black] = component_loss(
                table,
                coefficients,
                &task.octets,
                outer.values,
                uniform_weight(outer.octets()),
                Some(&mut by_coefficients),
            );
            (loss, task_weight(black) * task.reading_weight())
        };
        let refined = refinement.zip(self.tasks.inputs(index));
        let Some((kernels, inputs)) = refined else {
            by_coefficients
                .iter_mut()
                .for_each(|entry| *entry *= weight);
            self.loss += weight * loss;
            return by_coefficients;
        };
        let share = prepared.auxiliary_weight * weight;
        by_coefficients.iter_mut().for_each(|entry| *entry *= share);
        let refined = refinement::gradient(kernels, &inputs, &outer);
        add_scaled(&mut by_coefficients, weight, &refined.coefficients);
        self.loss += weight * refined.loss;
        self.add_refined(index, weight, &refined);
        by_coefficients
    }

    /// Adds the gradient of a task's refinement with respect to initial parameters, hyperparameters and angles of the
    /// present samples, and sets that with respect to the StartNet's output.
    fn add_refined(&mut self, index: usize, weight: f32, refined: &RefinementGradient) {
        add_scaled(&mut self.values.initial, weight, &refined.initial);
        if let Some(by_steps) = &mut self.hyperparameters.steps {
            by_steps.add_scaled(weight, &refined.hyperparameters);
        }
        let by_offsets = refined.initial.iter().map(|derivative| weight * derivative);
        self.tasks.batch.set_offset_gradient(index, by_offsets);
        let pattern = &self.tasks.prepared.pattern;
        for (sample, sum) in self.angles.iter_mut().enumerate() {
            if self.tasks.present[index][sample] {
                let by_sample = pattern.gradient_by_angles(&refined.samples, sample);
                add_scaled(sum, weight, &by_sample);
                let by_octet = refined.samples[sample / WIDTH].measured;
                let slopes = self.tasks.readings[index][sample].slopes;
                for (by_channel, slopes) in by_octet.iter().zip(&slopes) {
                    add_scaled(sum, weight * by_channel.0[sample % WIDTH], slopes);
                }
            }
        }
    }

    /// Adds the gradient with respect to the StartNet. Returns that with respect to the coefficients of each task, to which
    /// the StartNet's is added.
    fn start_net_adjoint(&mut self, by_coefficients: &[Vec<f32>]) -> Vec<Vec<f32>> {
        let (weights, batch) = (&self.tasks.prepared.weights, &mut self.tasks.batch);
        for (index, by_coefficients) in by_coefficients.iter().enumerate() {
            batch.set_coefficient_gradient(index, by_coefficients);
        }
        start_net_adjoint(batch, weights, &mut self.values.start_net);
        let tasks = 0..by_coefficients.len();
        tasks
            .map(|index| batch.coefficient_gradient(index))
            .collect()
    }

    /// Adds the gradient by way of the coefficients: with respect to the CoefficientNet, the precisions of the correction,
    /// and the angles of the samples.
    fn coefficient_adjoint(&mut self, by_coefficients: &[Vec<f32>]) {
        let tasks = &mut self.tasks;
        let prepared = tasks.prepared;
        for (index, readings) in tasks.readings.iter().enumerate() {
            let (corrected, by_corrected) = (&tasks.corrected[index], &by_coefficients[index]);
            let gradient = prepared
                .correction
                .adjoint(corrected, readings, by_corrected);
            add_scaled(
                &mut self.hyperparameters.precision,
                1.0,
                &gradient.precision,
            );
            for (sum, by_sample) in self.angles.iter_mut().zip(&gradient.angles) {
                add_scaled(sum, 1.0, by_sample);
            }
            tasks
                .batch
                .set_coefficient_gradient(index, &gradient.completed);
        }
        let by_net = &mut self.values.coefficient_net;
        coefficient_net_adjoint(&mut tasks.batch, &prepared.weights, by_net);
        for (index, readings) in tasks.readings.iter().enumerate() {
            let present = &tasks.present[index];
            let gain = prepared.gain(present);
            let samples = readings.iter().zip(present).enumerate();
            for (sample, (reading, _)) in samples.filter(|(_, (_, present))| **present) {
                let by_reading = tasks.batch.by_reading(index, sample);
                for (by_value, dual) in by_reading.iter().zip(&reading.standardized) {
                    add_scaled(&mut self.angles[sample], gain * by_value, &dual.tangent);
                }
            }
        }
    }
}

/// Returns the loss of f = 0.
fn loss_of_black(outer: &SampleOctets<'_>) -> f32 {
    let losses = (0..WIDTH * outer.octets()).map(|index| {
        let sample = outer.sample(index / WIDTH, index % WIDTH);
        let cosine = sample.at.cos_theta_i();
        let logarithms = sample.measured.map(|y| (y * cosine).ln_1p());
        sample.weight * logarithms.iter().sum::<f32>()
    });
    losses.sum()
}
