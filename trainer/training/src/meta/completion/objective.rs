//! What completes readings, and starts descents, as a [`MetaObjective`].

use glimpse_core::gonio::Limits;
use glimpse_kernels::completion::{Batch, CompletionWeights, Shape};
use glimpse_kernels::components::ComponentTable;
use glimpse_kernels::lanes::{InstructionSet, Octet, OctetAt, WIDTH};
use glimpse_kernels::samples::{OctetRgb, SampleOctets, SampleWeights};
use glimpse_optimizer::Groups;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::dataset::{Dataset, Part};
use super::draw::{Dropout, Task};
use super::first_weights::first_weights;
use super::order::{greedy_order, reorder};
use super::pool::WarpedPool;
use super::reading::{Present, Reading, ReadingCenters};
use super::refinement::{Refinement, RefinementGradient};
use super::weighted_loss::{WeightedLoss, mean, mean_weighed};
use crate::meta::objective::{Expected, MetaObjective, RandomStreams};
use crate::meta::pattern::{Pattern, reachable};
use crate::meta::phase::{OuterStep, Phase, StepSizeForm};
use crate::meta::plan::LossWeights;
use crate::meta::start::first_guess;

/// Tasks that one thread takes at once.
const BATCH: usize = 16;
/// Step sizes stay positive.
const FORM: StepSizeForm = StepSizeForm::Logarithm;
/// Of so many fresh octets of directions one is enough to put samples in order.
const ORDERED_BY: usize = 8;

/// A completion of readings: by itself for the model Linear, else with the descent that it starts.
pub struct CompletionObjective<'a> {
    /// The materials.
    pub dataset: &'a Dataset,
    /// What of them is seen.
    pub part: &'a Part,
    /// How large the map is.
    pub shape: Shape,
    /// What losses count for.
    pub weighing: LossWeights,
    /// All random numbers.
    pub streams: RandomStreams,
    /// The descent that coefficients start; None for the model Linear.
    pub refinement: Option<&'a dyn Refinement>,
    /// What step sizes begin with.
    pub first_step_size: f32,
    /// What the loss of coefficients counts for where a descent follows.
    pub auxiliary: f32,
    /// The machine that the pattern is for.
    pub limits: Limits,
    /// The pattern that all guesses begin with; each has one of its own where there is none.
    pub pattern: Option<&'a [f32]>,
}

/// Directions to judge at.
#[derive(Clone, Copy)]
struct Directions<'a> {
    pool: &'a WarpedPool,
    table: &'a ComponentTable,
}

/// Meta-parameters, ready to be applied to tasks.
struct Applied<'v> {
    values: &'v Groups<Vec<f32>>,
    weights: CompletionWeights<'v>,
    step_sizes: Vec<f32>,
    pattern: Pattern,
    centers: ReadingCenters,
}

/// Some tasks that were read and completed.
struct Completed {
    batch: Batch,
    present: Vec<Vec<bool>>,
}

/// What becomes of one task.
struct Outcome {
    /// Weighed.
    loss: f32,
    /// The task's weight.
    weight: f32,
    by_coefficients: Vec<f32>,
    /// Not weighed.
    refined: Option<RefinementGradient>,
}

/// Samples that each count the same.
fn evenly<'s>(at: &'s [OctetAt], values: &'s [OctetRgb]) -> SampleOctets<'s> {
    let weight = Octet([weight_of_each(values.len()); WIDTH]);
    SampleOctets {
        at,
        values,
        order: None,
        weights: SampleWeights::Mean([weight; 2]),
        instruction_set: InstructionSet::of_this_machine(),
        in_a_row: false,
    }
}

/// What a value counts for in a mean over so many octets of directions.
fn weight_of_each(octets: usize) -> f32 {
    1.0 / (3 * WIDTH * octets) as f32
}

/// sum += factor * vector
fn add_scaled(sum: &mut [f32], factor: f32, vector: &[f32]) {
    for (entry, value) in sum.iter_mut().zip(vector) {
        *entry += factor * value;
    }
}

impl<'a> CompletionObjective<'a> {
    fn in_training(&self) -> Directions<'a> {
        Directions {
            pool: &self.dataset.pool,
            table: &self.part.table,
        }
    }

    fn fresh(&self) -> Directions<'a> {
        Directions {
            pool: &self.dataset.fresh,
            table: &self.part.fresh,
        }
    }

    /// The pattern as a recipe has it.
    fn reachable(&self, values: &Groups<Vec<f32>>) -> Pattern {
        Pattern::new(reachable(&values.pattern, &self.limits))
    }

    fn applied<'v>(&self, values: &'v Groups<Vec<f32>>, pattern: Pattern) -> Applied<'v> {
        Applied {
            values,
            weights: CompletionWeights {
                shape: self.shape,
                completion: &values.completion,
                start: &values.start,
            },
            step_sizes: FORM.step_sizes(&values.hyperparameters),
            centers: ReadingCenters::new(&self.part.basis, pattern.angles()),
            pattern,
        }
    }

    /// Reads a task wherever the pattern says, whatever is missing.
    fn read(&self, by: &Applied<'_>, task: &Task) -> Vec<Reading> {
        Reading::all(
            task,
            &self.dataset.materials,
            &self.dataset.variety,
            by.pattern.angles(),
            &by.centers,
        )
    }

    fn read_all(&self, by: &Applied<'_>, tasks: &[Task]) -> Vec<Vec<Reading>> {
        tasks.iter().map(|task| self.read(by, task)).collect()
    }

    /// What readings are multiplied by that are there.
    fn gain(&self, present: &[bool]) -> f32 {
        let missing = self.dataset.variety.where_missing();
        missing.dropout_gain(present.iter().copied())
    }

    /// Completes readings of some tasks.
    fn complete(&self, by: &Applied<'_>, tasks: &[Task], readings: &[Vec<Reading>]) -> Completed {
        let mut batch = Batch::new(self.shape, tasks.len());
        let mut there = Vec::with_capacity(tasks.len());
        for (index, (task, readings)) in tasks.iter().zip(readings).enumerate() {
            let present = task.present.iter().zip(by.pattern.valid());
            let present: Vec<bool> = present.map(|(there, valid)| *there && *valid).collect();
            let gain = self.gain(&present);
            for (sample, reading) in readings.iter().enumerate() {
                let values = reading.standardized.map(|dual| gain * dual.value);
                batch.set(index, sample, present[sample].then_some(values));
            }
            there.push(present);
        }
        batch.complete(&by.weights);
        Completed {
            batch,
            present: there,
        }
    }

    /// theta_0 of a task: what all share, and what the start adds.
    fn start_of(by: &Applied<'_>, completed: &Completed, index: usize) -> Vec<f32> {
        let mut start = completed.batch.offsets(index);
        add_scaled(&mut start, 1.0, &by.values.initial);
        start
    }

    /// The loss of one task, and its gradients.
    fn outcome(
        &self,
        by: &Applied<'_>,
        completed: &Completed,
        readings: &[Reading],
        index: usize,
        task: &Task,
        refinement: Option<&dyn Refinement>,
    ) -> Outcome {
        let Directions { pool, table } = self.in_training();
        let values = task.values(pool);
        let coefficients = completed.batch.coefficients(index);
        let mut by_coefficients = vec![0.0; coefficients.len()];
        let [lost, black] = table.loss(
            &coefficients,
            &task.octets,
            &values,
            weight_of_each(values.len()),
            Some(&mut by_coefficients),
        );
        let weight = self.weighing.weight(black) * task.weight_of_readings();
        let share = match refinement {
            Some(_) => self.auxiliary,
            None => 1.0,
        };
        for by in &mut by_coefficients {
            *by *= share * weight;
        }
        let refined = refinement.map(|refinement| {
            let at = task.octets.iter().map(|octet| pool.at[*octet as usize]);
            let at: Vec<_> = at.collect();
            let read = Present::new(readings, &completed.present[index]);
            refinement.gradient(
                &Self::start_of(by, completed, index),
                &by.step_sizes,
                &read.octets(&by.pattern),
                &evenly(&at, &values),
            )
        });
        Outcome {
            loss: weight * refined.as_ref().map_or(lost, |refined| refined.loss),
            weight,
            by_coefficients,
            refined,
        }
    }

    /// The loss of some tasks, and its gradient; the one by the pattern as by the angles.
    fn batch(
        &self,
        by: &Applied<'_>,
        tasks: &[Task],
        refinement: Option<&dyn Refinement>,
    ) -> (f32, Groups<Vec<f32>>, Vec<[f32; 3]>) {
        let readings = self.read_all(by, tasks);
        let mut completed = self.complete(by, tasks, &readings);
        let mut loss = 0.0;
        let mut gradient = by.values.as_ref().map(|list| vec![0.0; list.len()]);
        let mut by_angles = vec![[0.0; 3]; self.shape.samples];
        for (index, (task, readings)) in tasks.iter().zip(&readings).enumerate() {
            let found = self.outcome(by, &completed, readings, index, task, refinement);
            loss += found.loss;
            let batch = &mut completed.batch;
            batch.set_gradient(index, &found.by_coefficients);
            let (weight, Some(mut refined)) = (found.weight, found.refined) else {
                continue;
            };
            FORM.chain(&mut refined.step_sizes, &by.step_sizes);
            add_scaled(&mut gradient.initial, weight, &refined.start);
            add_scaled(&mut gradient.hyperparameters, weight, &refined.step_sizes);
            batch.set_offset_gradient(index, refined.start.iter().map(|by| weight * by));
            for (sample, sum) in by_angles.iter_mut().enumerate() {
                if completed.present[index][sample] {
                    let by_sample = by.pattern.by_angles(&refined.samples, sample);
                    add_scaled(sum, weight, &by_sample);
                }
            }
        }
        let Completed { mut batch, present } = completed;
        batch.adjoint(&by.weights, &mut gradient.completion, &mut gradient.start);
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

    /// The loss of some tasks, not weighed, and what each counts for; after the descent, or of the
    /// completed coefficients.
    fn losses(
        &self,
        by: &Applied<'_>,
        tasks: &[Task],
        refinement: Option<&dyn Refinement>,
        at: Directions<'_>,
    ) -> Vec<WeightedLoss> {
        let of_some = |tasks: &[Task]| {
            let readings = self.read_all(by, tasks);
            self.losses_of_read(by, tasks, &readings, refinement, at)
        };
        tasks.par_chunks(BATCH).flat_map_iter(of_some).collect()
    }

    /// The same of tasks that were read.
    fn losses_of_read(
        &self,
        by: &Applied<'_>,
        tasks: &[Task],
        readings: &[Vec<Reading>],
        refinement: Option<&dyn Refinement>,
        at: Directions<'_>,
    ) -> Vec<WeightedLoss> {
        let completed = self.complete(by, tasks, readings);
        let each = tasks.iter().zip(readings).enumerate();
        let each = each.map(|(index, (task, readings))| {
            let values = task.values(at.pool);
            let coefficients = completed.batch.coefficients(index);
            let count = weight_of_each(values.len());
            let [lost, black] = at
                .table
                .loss(&coefficients, &task.octets, &values, count, None);
            let weight = self.weighing.weight(black);
            let Some(refinement) = refinement else {
                return WeightedLoss { loss: lost, weight };
            };
            let start = Self::start_of(by, &completed, index);
            let read = Present::new(readings, &completed.present[index]);
            let parameters = refinement.fit(&start, &by.step_sizes, &read.octets(&by.pattern));
            let places = task.octets.iter().map(|octet| at.pool.at[*octet as usize]);
            let places: Vec<_> = places.collect();
            let loss = refinement.loss(&parameters, &evenly(&places, &values));
            WeightedLoss { loss, weight }
        });
        each.collect()
    }

    /// The loss of tasks, not weighed, where training judges them.
    #[must_use]
    pub fn losses_of(&self, values: &Groups<Vec<f32>>, tasks: &[Task]) -> Vec<f32> {
        let by = self.applied(values, self.reachable(values));
        let losses = self.losses(&by, tasks, self.refinement, self.in_training());
        losses.iter().map(|each| each.loss).collect()
    }

    /// What readings of tasks are completed to: the mean over channels of each coefficient.
    #[must_use]
    pub fn mean_coefficients(&self, values: &Groups<Vec<f32>>, tasks: &[Task]) -> Vec<Vec<f32>> {
        let by = self.applied(values, self.reachable(values));
        let of_some = |tasks: &[Task]| -> Vec<Vec<f32>> {
            let completed = self.complete(&by, tasks, &self.read_all(&by, tasks));
            let components = self.shape.components;
            let each = (0..tasks.len()).map(|index| {
                let all = completed.batch.coefficients(index);
                let mean = |k| (all[k] + all[components + k] + all[2 * components + k]) / 3.0;
                (0..components).map(mean).collect()
            });
            each.collect()
        };
        tasks.par_chunks(BATCH).flat_map_iter(of_some).collect()
    }

    /// The loss of some of the materials that are learned from, as they are, at fresh directions.
    #[must_use]
    pub fn losses_of_materials(&self, values: &Groups<Vec<f32>>, materials: &[usize]) -> Vec<f32> {
        let tasks = self.plain_tasks(materials);
        let by = self.applied(values, self.reachable(values));
        let judged = self.losses(&by, &tasks, self.refinement, self.fresh());
        judged.iter().map(|each| each.loss).collect()
    }

    /// Materials as they are, at all fresh directions.
    fn plain_tasks(&self, materials: &[usize]) -> Vec<Task> {
        let octets = self.fresh().pool.octets();
        let plain = |material: &usize| Task::plain(*material, self.shape.samples, octets);
        materials.iter().map(plain).collect()
    }
}

impl MetaObjective for CompletionObjective<'_> {
    fn first_values(&self, guess: u64) -> Groups<Vec<f32>> {
        let mut random = ChaCha8Rng::seed_from_u64(self.streams.guess(guess));
        let [completion, start] = first_weights(self.shape, &mut random);
        let initial = match self.refinement {
            Some(refinement) => first_guess(refinement.model(), &mut random),
            None => Vec::new(),
        };
        Groups {
            hyperparameters: vec![FORM.value(self.first_step_size); initial.len()],
            initial,
            pattern: match self.pattern {
                Some(pattern) => pattern.to_vec(),
                None => self.streams.first_pattern(guess, self.shape.samples),
            },
            completion,
            start,
        }
    }

    /// By the completed coefficients of the materials judged.
    fn in_order(&self, mut values: Groups<Vec<f32>>) -> Groups<Vec<f32>> {
        if self.dataset.variety.missing == 0.0 {
            return values;
        }
        let by = self.applied(&values, self.reachable(&values));
        let mut tasks = self.plain_tasks(&self.part.judged);
        for task in &mut tasks {
            task.octets = task.octets.iter().copied().step_by(ORDERED_BY).collect();
        }
        let readings = tasks.par_iter().map(|task| self.read(&by, task));
        let readings: Vec<Vec<Reading>> = readings.collect();
        let order = greedy_order(self.shape.samples, |present| {
            for task in &mut tasks {
                task.present.copy_from_slice(present);
            }
            let parts = tasks.par_chunks(BATCH).zip(readings.par_chunks(BATCH));
            let judged = parts.flat_map_iter(|(tasks, readings)| {
                self.losses_of_read(&by, tasks, readings, None, self.fresh())
            });
            mean_weighed(&judged.collect::<Vec<_>>())
        });
        reorder(&mut values.pattern, 3, &order);
        reorder(&mut values.completion, 3 * self.shape.rows(), &order);
        values
    }

    fn gradient(&self, values: &Groups<Vec<f32>>, at: OuterStep<'_>) -> (f32, Groups<Vec<f32>>) {
        let by = self.applied(values, Pattern::within(&values.pattern, self.limits));
        let lost = match at.phase.in_order {
            true => Dropout::LastOrFew,
            false => Dropout::Any,
        };
        let tasks: Vec<Task> = (0..at.phase.batch)
            .map(|slot| {
                let mut random = self.streams.slot(at, slot + 1);
                Task::random(
                    &self.dataset.pool,
                    &self.part.groups,
                    &self.dataset.variety,
                    [self.shape.samples, at.phase.outer],
                    lost,
                    &mut random,
                )
            })
            .collect();
        let refinement = self.refinement.filter(|_| at.phase.rates.start > 0.0);
        let found: Vec<_> = tasks
            .par_chunks(BATCH)
            .map(|tasks| self.batch(&by, tasks, refinement))
            .collect();
        let share = 1.0 / tasks.len() as f32;
        let mut loss = 0.0;
        let mut gradient = values.as_ref().map(|list| vec![0.0; list.len()]);
        let mut by_angles = vec![[0.0; 3]; self.shape.samples];
        for (part, by, angles) in &found {
            loss += share * part;
            for (sum, by) in gradient.each_mut().into_iter().zip(by.each()) {
                add_scaled(sum, share, by);
            }
            for (sum, by) in by_angles.iter_mut().zip(angles) {
                add_scaled(sum, share, by);
            }
        }
        gradient.pattern = by.pattern.gradient_by_logits(|sample| by_angles[sample]);
        (loss, gradient)
    }

    fn fitness(&self, values: &Groups<Vec<f32>>, _: &Phase) -> f32 {
        self.judge(values)
    }

    /// Of the completed coefficients: a start is trained only after patterns were tried.
    fn judge(&self, values: &Groups<Vec<f32>>) -> f32 {
        let by = self.applied(values, self.reachable(values));
        let tasks = self.plain_tasks(&self.part.judged);
        mean_weighed(&self.losses(&by, &tasks, None, self.fresh()))
    }

    fn expected(&self, values: &Groups<Vec<f32>>) -> Expected {
        let losses = self.losses_of_materials(values, &self.part.judged);
        let losses = losses.iter().copied();
        Expected::new(mean(losses.clone()), losses.map(f64::from))
    }
}
