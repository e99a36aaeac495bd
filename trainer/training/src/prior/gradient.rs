//! The gradient of the loss of a chunk of tasks.

use glimpse_fitting::linear::add_scaled;
use glimpse_kernels::lanes::WIDTH;
use glimpse_kernels::samples::SampleOctets;

use super::completed_tasks::{CompletedTasks, Prepared, task_weight};
use super::dataset::Directions;
use super::hyperparameters::Hyperparameters;
use super::refinement::{Refinement, RefinementGradient};
use crate::phase::Values;
use crate::tasks::samples::uniform_weight;
use crate::tasks::task::Task;

/// The terms of a task's loss.
#[derive(Clone, Copy)]
pub(super) struct Terms {
    /// The refinement; None for the loss of the coefficients.
    pub(super) refinement: Option<Refinement>,
    /// The weight of the loss before the refinement in the gradient. The weight of the loss after it is 1.
    pub(super) auxiliary_weight: f32,
}

/// The sum of losses of tasks, and its gradient.
struct ChunkGradient<'a> {
    tasks: CompletedTasks<'a>,
    loss: f32,
    /// The gradient of all groups but the hyperparameters and the pattern.
    values: Values,
    hyperparameters: Hyperparameters,
    /// The gradient with respect to the angles of each sample; empty at random directions.
    angles: Vec<[f32; 3]>,
}

/// Returns the weighted sum of the losses of tasks, and its gradient. That of the pattern is with respect to the angles.
pub(super) fn chunk_gradient(
    prepared: &Prepared<'_>,
    tasks: &[Task],
    terms: Terms,
) -> (f32, Values) {
    let readings = prepared.read_all(tasks);
    let mut sum = ChunkGradient {
        tasks: CompletedTasks::new(prepared, tasks, &readings),
        loss: 0.0,
        values: prepared.values.as_ref().map(|list| vec![0.0; list.len()]),
        hyperparameters: prepared.hyperparameters.zeros(),
        angles: vec![[0.0; 3]; prepared.weights.shape.samples],
    };
    let by_coefficients = (0..tasks.len()).map(|index| sum.add_task(index, terms));
    let mut by_coefficients: Vec<Vec<f32>> = by_coefficients.collect();
    if terms.refinement.is_some() {
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
    fn add_task(&mut self, index: usize, terms: Terms) -> Vec<f32> {
        let prepared = self.tasks.prepared;
        let Directions { pool, table } = &prepared.subset.training;
        let task = &self.tasks.tasks[index];
        let outer = task.samples(pool);
        let outer = outer.octets();
        let coefficients = &self.tasks.corrected[index].coefficients;
        let mut by_coefficients = vec![0.0; coefficients.len()];
        let (loss, weight) = if prepared.random_directions.is_some() {
            (0.0, task_weight(loss_of_black(&outer)))
        } else {
            let [loss, black] = table.loss(
                coefficients,
                &task.octets,
                outer.values,
                uniform_weight(outer.octets()),
                Some(&mut by_coefficients),
            );
            (loss, task_weight(black) * task.reading_weight())
        };
        let refined = terms.refinement.zip(self.tasks.inputs(index));
        let Some((refinement, inputs)) = refined else {
            by_coefficients
                .iter_mut()
                .for_each(|entry| *entry *= weight);
            self.loss += weight * loss;
            return by_coefficients;
        };
        let share = terms.auxiliary_weight * weight;
        by_coefficients.iter_mut().for_each(|entry| *entry *= share);
        let refined = refinement.gradient(&inputs, &outer);
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
        batch.start_net_adjoint(weights, &mut self.values.start_net);
        let tasks = 0..by_coefficients.len();
        tasks
            .map(|index| batch.coefficient_gradient(index))
            .collect()
    }

    /// Adds the gradient by way of the coefficients: with respect to the CoefficientNet, the precisions of the correction,
    /// and the angles of the samples.
    fn coefficient_adjoint(&mut self, by_coefficients: &[Vec<f32>]) {
        let CompletedTasks {
            prepared,
            readings,
            present,
            corrected,
            batch,
            ..
        } = &mut self.tasks;
        for (index, readings) in readings.iter().enumerate() {
            let correction = &prepared.correction;
            let gradient = correction.adjoint(&corrected[index], readings, &by_coefficients[index]);
            add_scaled(
                &mut self.hyperparameters.precision,
                1.0,
                &gradient.precision,
            );
            for (sum, by_sample) in self.angles.iter_mut().zip(&gradient.angles) {
                add_scaled(sum, 1.0, by_sample);
            }
            batch.set_coefficient_gradient(index, &gradient.completed);
        }
        batch.adjoint(&prepared.weights, &mut self.values.coefficient_net);
        for (index, readings) in readings.iter().enumerate() {
            let gain = prepared.gain(&present[index]);
            let samples = readings.iter().zip(&present[index]).enumerate();
            for (sample, (reading, _)) in samples.filter(|(_, (_, present))| **present) {
                let by_reading = batch.by_reading(index, sample);
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
