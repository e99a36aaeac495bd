//! The model Linear, its readings completed, as a [`Trainee`].

use glimpse_core::fit::completion::standardized;
use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear::EPSILON;
use glimpse_core::numeric::Scalar;
use glimpse_kernels::Dual;
use glimpse_kernels::completion::{Batch, Shape, Weights};
use glimpse_kernels::components::ComponentTable;
use glimpse_kernels::lanes::{InstructionSet, Octet, WIDTH};
use glimpse_kernels::samples::{OctetRgb, SampleOctets, Weights as SampleWeights, transpose_rgb};
use glimpse_optimizer::Groups;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::draw::{Group, Task, Variety};
use super::field::{FIELD, field_at};
use super::pool::WarpedPool;
use super::refinement::Refinement;
use crate::linear::{Basis, widened};
use crate::material::Material;
use crate::meta::pattern::{Pattern, above_horizon};
use crate::meta::phase::{OuterStep, Phase, StepSizeForm};
use crate::meta::plan::Weighing;
use crate::meta::start::first_guess;
use crate::meta::trainee::{Expected, RandomStreams, Trainee};

/// Tasks that one thread takes at once.
const BATCH: usize = 16;
/// What logarithms of readings are multiplied by, once centred.
pub const SCALE: f32 = 0.5;

/// Materials, with their values at directions, and components there.
pub struct PriorTasks<'a> {
    /// The materials.
    pub materials: &'a [Box<dyn Material>],
    /// Their values.
    pub pool: WarpedPool,
    /// Principal components at the same directions.
    pub table: ComponentTable,
}

/// The model Linear, its readings completed.
pub struct PriorTrainee<'a> {
    /// What it is trained on.
    pub training: &'a PriorTasks<'a>,
    /// What it is judged on.
    pub validation: &'a PriorTasks<'a>,
    /// Principal components.
    pub basis: &'a Basis,
    /// How large the map is.
    pub shape: Shape,
    /// How tasks are varied.
    pub variety: Variety,
    /// Which materials tasks are of.
    pub groups: Vec<Group>,
    /// What losses count for.
    pub weighing: Weighing,
    /// All random numbers.
    pub streams: RandomStreams,
    /// The descent that coefficients start; None for the model Linear.
    pub refinement: Option<&'a dyn Refinement>,
    /// What step sizes begin with.
    pub first_step_size: f32,
    /// What the loss of coefficients counts for where a descent follows.
    pub auxiliary: f32,
}

/// What a pattern's samples are centred by.
pub struct Centres(Vec<(Dual<f32, 3>, Dual<f32, 3>)>);

impl Centres {
    /// cos(theta_i) cos(theta_o), and the mean of mapped columns.
    #[must_use]
    pub fn new(basis: &Basis, angles: &[Angles<f32>]) -> Self {
        let all = angles.iter().map(|angles| {
            let found = basis.look_up(widened(angles));
            let at = HalfDifference::from_angles(Dual::<f32, 3>::variables(*angles));
            let [mean, by @ ..] =
                std::array::from_fn::<f64, 4, _>(|i| found.mean[i] + found.log_median[i]);
            let centre = Dual {
                value: (mean - EPSILON.ln()) as f32,
                tangent: by.map(|by| by as f32),
            };
            (at.cos_theta_i() * at.cos_theta_o(), centre)
        });
        Self(all.collect())
    }

    /// The means alone.
    #[must_use]
    pub fn values(&self) -> Vec<f32> {
        self.0.iter().map(|(_, centre)| centre.value).collect()
    }
}

/// A reading: the BRDF, and as it enters the completion, with derivatives by the angles.
struct Reading {
    brdf: [f32; 3],
    standardized: [Dual<f32, 3>; 3],
}

/// Samples of a pattern that were read of one task.
struct Read {
    values: Vec<OctetRgb>,
    weights: Vec<Octet>,
}

impl Read {
    fn new(readings: &[Reading], present: &[bool]) -> Self {
        let brdf: Vec<[f32; 3]> = readings.iter().map(|reading| reading.brdf).collect();
        let count = present.iter().filter(|present| **present).count().max(1);
        let mut weights = vec![Octet::default(); readings.len().div_ceil(WIDTH)];
        for (index, _) in present.iter().enumerate().filter(|(_, present)| **present) {
            weights[index / WIDTH].0[index % WIDTH] = 1.0 / (3.0 * count as f32);
        }
        Self {
            values: brdf.chunks(WIDTH).map(transpose_rgb).collect(),
            weights,
        }
    }

    fn octets<'s>(&'s self, pattern: &'s Pattern) -> SampleOctets<'s> {
        SampleOctets {
            at: pattern.octets_at(),
            values: &self.values,
            order: None,
            weights: SampleWeights::Each(&self.weights),
            instruction_set: InstructionSet::of_this_machine(),
            in_a_row: false,
        }
    }
}

/// What becomes of one task.
struct Outcome {
    loss: f32,
    by_coefficients: Vec<f32>,
    refined: Option<super::refinement::RefinementGradient>,
    relative: f32,
}

impl PriorTrainee<'_> {
    /// Reads a task's material.
    fn read(
        &self,
        task: &Task,
        materials: &[Box<dyn Material>],
        angles: &[Angles<f32>],
        centres: &Centres,
    ) -> Vec<Reading> {
        let look_up = |material: usize, warp: usize| {
            let warp = self.variety.warps[warp];
            let (places, slopes): (Vec<_>, Vec<_>) =
                angles.iter().map(|angles| warp.angles(*angles)).unzip();
            let mut found = vec![Default::default(); angles.len()];
            materials[material].brdf_batch_with_derivative(&places, &mut found);
            for ((_, derivatives), [by_theta_h, by_theta_d, by_phi_d]) in
                found.iter_mut().zip(slopes)
            {
                for [theta_h, theta_d, phi_d] in derivatives.iter_mut() {
                    *theta_d += *theta_h * by_theta_d;
                    *phi_d += *theta_h * by_phi_d;
                    *theta_h *= by_theta_h;
                }
            }
            found
        };
        let own = look_up(task.material, task.warps[0]);
        let variation = &task.variation;
        let partner = (variation.share > 0.0).then(|| look_up(variation.partner, task.warps[1]));
        own.iter()
            .enumerate()
            .map(|(sample, (brdf, derivatives))| {
                let factor = match task.field == [0.0; FIELD] {
                    true => Dual::from_value(1.0),
                    false => {
                        let at =
                            HalfDifference::from_angles(Dual::<f32, 3>::variables(angles[sample]));
                        let terms = field_at(&at).into_iter().zip(task.field);
                        terms
                            .fold(Dual::from_value(0.0), |sum: Dual<f32, 3>, (f, c)| {
                                sum + f * Dual::from_value(c)
                            })
                            .exp()
                    }
                };
                let mut measured = [0.0; 3];
                let standardized = std::array::from_fn(|channel| {
                    let from = variation.order[channel];
                    let share = task.shares[channel];
                    let gain = (1.0 - share) * variation.gains[channel];
                    let mut y = Dual {
                        value: gain * brdf[from],
                        tangent: derivatives[from].map(|by| gain * by),
                    };
                    if let Some(partner) = &partner {
                        let (brdf, derivatives) = &partner[sample];
                        y.value += share * brdf[channel];
                        for (y, by) in y.tangent.iter_mut().zip(derivatives[channel]) {
                            *y += share * by;
                        }
                    }
                    y = y * factor;
                    if let Some([factor, added]) = task.noise.get(sample) {
                        y = y * Dual::from_value(factor[channel])
                            + Dual::from_value(added[channel]);
                        // A fit brings up what is too far below 0.
                        let (weight, _) = &centres.0[sample];
                        let least = -0.5 * EPSILON as f32 / weight.value.max(1e-6);
                        if y.value < least {
                            y = Dual::from_value(least);
                        }
                    }
                    let (weight, centre) = centres.0[sample];
                    measured[channel] = y.value;
                    standardized(y, weight, centre, Dual::from_value(SCALE))
                });
                Reading {
                    brdf: measured,
                    standardized,
                }
            })
            .collect()
    }

    fn weights<'v>(&self, values: &'v Groups<Vec<f32>>) -> Weights<'v> {
        Weights {
            shape: self.shape,
            completion: &values.completion,
            start: &values.start,
        }
    }

    /// theta_0 of a task.
    fn start_of(values: &Groups<Vec<f32>>, offsets: Vec<f32>) -> Vec<f32> {
        let mut start = offsets;
        for (entry, initial) in start.iter_mut().zip(&values.initial) {
            *entry += initial;
        }
        start
    }

    /// The loss of one task, and its gradients.
    #[expect(clippy::too_many_arguments, reason = "all that a task is judged by")]
    fn judge_task(
        &self,
        task: &Task,
        read: &Read,
        pattern: &Pattern,
        coefficients: &[f32],
        start: &[f32],
        step_sizes: &[f32],
        refines: bool,
    ) -> Outcome {
        let PriorTasks { pool, table, .. } = self.training;
        let outer = task.values(pool);
        let count = 1.0 / (3 * WIDTH * task.order.len()) as f32;
        let mut by_coefficients = vec![0.0; coefficients.len()];
        let [lost, black] = table.loss(
            coefficients,
            &task.order,
            &outer,
            count,
            Some(&mut by_coefficients),
        );
        let relative = self.weighing.weight(black);
        let refinement = self.refinement.filter(|_| refines);
        let share = if refinement.is_some() {
            self.auxiliary
        } else {
            1.0
        };
        for by in &mut by_coefficients {
            *by *= share * relative;
        }
        let Some(refinement) = refinement else {
            return Outcome {
                loss: relative * lost,
                by_coefficients,
                refined: None,
                relative,
            };
        };
        let at: Vec<_> = task
            .order
            .iter()
            .map(|octet| pool.at[*octet as usize])
            .collect();
        let outer = SampleOctets {
            at: &at,
            values: &outer,
            order: None,
            weights: SampleWeights::Mean([Octet([count; WIDTH]); 2]),
            instruction_set: InstructionSet::of_this_machine(),
            in_a_row: false,
        };
        let inner = read.octets(pattern);
        let refined = refinement.gradient(start, step_sizes, &inner, &outer);
        let loss = relative * refined.loss;
        Outcome {
            loss,
            by_coefficients,
            refined: Some(refined),
            relative,
        }
    }

    /// The loss of some tasks, and its gradient; the one by the pattern as by the angles.
    fn batch(
        &self,
        values: &Groups<Vec<f32>>,
        pattern: &Pattern,
        centres: &Centres,
        tasks: &[Task],
        refines: bool,
    ) -> (f32, Groups<Vec<f32>>, Vec<[f32; 3]>) {
        let weights = self.weights(values);
        let step_sizes = FORM.step_sizes(&values.hyperparameters);
        let mut batch = Batch::new(self.shape, tasks.len());
        let valid = pattern.valid();
        let present: Vec<Vec<bool>> = tasks
            .iter()
            .map(|task| {
                task.present
                    .iter()
                    .zip(valid)
                    .map(|(present, valid)| *present && *valid)
                    .collect()
            })
            .collect();
        let readings: Vec<Vec<Reading>> = tasks
            .iter()
            .enumerate()
            .map(|(index, task)| {
                let readings = self.read(task, self.training.materials, pattern.angles(), centres);
                for (sample, reading) in readings.iter().enumerate() {
                    let there = present[index][sample];
                    let values = reading.standardized.map(|dual| dual.value);
                    batch.set(index, sample, there.then_some(values));
                }
                readings
            })
            .collect();
        batch.complete(&weights);
        let mut loss = 0.0;
        let mut gradient = values.as_ref().map(|list| vec![0.0; list.len()]);
        let mut by_angles = vec![[0.0; 3]; pattern.angles().len()];
        for (index, task) in tasks.iter().enumerate() {
            let start = Self::start_of(values, batch.offsets(index));
            let read = Read::new(&readings[index], &present[index]);
            let coefficients = batch.coefficients(index);
            let found = self.judge_task(
                task,
                &read,
                pattern,
                &coefficients,
                &start,
                &step_sizes,
                refines,
            );
            loss += found.loss;
            batch.set_gradient(index, &found.by_coefficients);
            let Some(mut refined) = found.refined else {
                continue;
            };
            FORM.chain(&mut refined.step_sizes, &step_sizes);
            add_scaled(&mut gradient.initial, found.relative, &refined.start);
            add_scaled(
                &mut gradient.hyperparameters,
                found.relative,
                &refined.step_sizes,
            );
            batch.set_offset_gradient(index, refined.start.iter().map(|by| found.relative * by));
            for (sample, sum) in by_angles.iter_mut().enumerate() {
                if present[index][sample] {
                    add_scaled(
                        sum,
                        found.relative,
                        &pattern.by_angles(&refined.samples, sample),
                    );
                }
            }
        }
        batch.adjoint(&weights, &mut gradient.completion, &mut gradient.start);
        for (index, readings) in readings.iter().enumerate() {
            for (sample, reading) in readings.iter().enumerate() {
                if present[index][sample] {
                    let by_reading = batch.by_reading(index, sample);
                    for (by_value, dual) in by_reading.iter().zip(&reading.standardized) {
                        add_scaled(&mut by_angles[sample], *by_value, &dual.tangent);
                    }
                }
            }
        }
        (loss, gradient, by_angles)
    }

    /// The loss of each material of some tasks, with so many of its first readings.
    #[must_use]
    pub fn losses(
        &self,
        tasks: &PriorTasks<'_>,
        values: &Groups<Vec<f32>>,
        first: usize,
    ) -> Vec<f32> {
        let pattern = Pattern::new(above_horizon(&values.pattern));
        let centres = Centres::new(self.basis, pattern.angles());
        let all: Vec<usize> = (0..tasks.materials.len()).collect();
        let weights = self.weights(values);
        let step_sizes = FORM.step_sizes(&values.hyperparameters);
        let samples = pattern.angles().len();
        let present: Vec<bool> = (0..samples).map(|sample| sample < first).collect();
        all.par_chunks(BATCH)
            .flat_map_iter(|chunk| {
                let mut batch = Batch::new(self.shape, chunk.len());
                let plain: Vec<Task> = chunk
                    .iter()
                    .map(|material| Task::plain(*material, samples, tasks.pool.octets()))
                    .collect();
                let readings: Vec<Vec<Reading>> = plain
                    .iter()
                    .enumerate()
                    .map(|(index, task)| {
                        let readings = self.read(task, tasks.materials, pattern.angles(), &centres);
                        for (sample, reading) in readings.iter().enumerate() {
                            let values = reading.standardized.map(|dual| dual.value);
                            batch.set(index, sample, present[sample].then_some(values));
                        }
                        readings
                    })
                    .collect();
                batch.complete(&weights);
                let losses: Vec<f32> = plain
                    .iter()
                    .enumerate()
                    .map(|(index, task)| {
                        let outer = tasks.pool.values(task.material, 0);
                        let count = 1.0 / (3 * WIDTH * task.order.len()) as f32;
                        let Some(refinement) = self.refinement else {
                            return tasks.table.loss(
                                &batch.coefficients(index),
                                &task.order,
                                outer,
                                count,
                                None,
                            )[0];
                        };
                        let start = Self::start_of(values, batch.offsets(index));
                        let read = Read::new(&readings[index], &present);
                        let parameters =
                            refinement.fit(&start, &step_sizes, &read.octets(&pattern));
                        let outer = SampleOctets {
                            at: &tasks.pool.at,
                            values: outer,
                            order: None,
                            weights: SampleWeights::Mean([Octet([count; WIDTH]); 2]),
                            instruction_set: InstructionSet::of_this_machine(),
                            in_a_row: false,
                        };
                        refinement.loss(&parameters, &outer)
                    })
                    .collect();
                losses
            })
            .collect()
    }
}

/// Step sizes stay positive.
const FORM: StepSizeForm = StepSizeForm::Logarithm;

/// sum += factor * vector
fn add_scaled(sum: &mut [f32], factor: f32, vector: &[f32]) {
    for (entry, value) in sum.iter_mut().zip(vector) {
        *entry += factor * value;
    }
}

impl Trainee for PriorTrainee<'_> {
    fn first_values(&self, guess: u64) -> Groups<Vec<f32>> {
        let shape = self.shape;
        let mut random = ChaCha8Rng::seed_from_u64(self.streams.guess(guess));
        let [readings, bias, output] = shape.completion_lengths();
        let mut uniform = |reach: f32| reach * (2.0 * random.random::<f32>() - 1.0);
        let mut completion = Vec::with_capacity(readings + bias + output);
        let rows = shape.rows();
        let few = 1.0 / (shape.samples as f32).sqrt();
        for index in 0..readings {
            let (column, row) = (index / rows, index % rows);
            completion.push(match (row < shape.components, column % 3) {
                (_, 2) => 0.0,
                (true, _) => uniform(0.3 * few),
                (false, _) => uniform(few),
            });
        }
        completion.extend(std::iter::repeat_n(0.0, bias));
        let reach = 0.3 / (shape.hidden.max(1) as f32).sqrt();
        completion.extend((0..output).map(|_| uniform(reach)));
        let [hidden, bias, output] = shape.start_lengths();
        let reach = 1.0 / (3.0 * shape.components as f32).sqrt();
        let mut start: Vec<f32> = (0..hidden).map(|_| uniform(reach)).collect();
        start.extend(std::iter::repeat_n(0.0, bias));
        start.extend((0..output).map(|_| uniform(FIRST_OFFSETS)));
        let initial = match self.refinement {
            Some(refinement) => first_guess(refinement.model(), &mut random),
            None => Vec::new(),
        };
        Groups {
            hyperparameters: vec![FORM.value(self.first_step_size); initial.len()],
            initial,
            pattern: self.streams.first_pattern(guess, shape.samples),
            completion,
            start,
        }
    }

    fn gradient(&self, values: &Groups<Vec<f32>>, at: OuterStep<'_>) -> (f32, Groups<Vec<f32>>) {
        let pattern = Pattern::from_logits(&values.pattern);
        let centres = Centres::new(self.basis, pattern.angles());
        let tasks: Vec<Task> = (0..at.phase.batch)
            .map(|slot| {
                let mut random = self.streams.slot(at, slot + 1);
                let sizes = [self.shape.samples, at.phase.outer];
                Task::random(
                    &self.training.pool,
                    &self.groups,
                    &self.variety,
                    sizes,
                    &mut random,
                )
            })
            .collect();
        let refines = at.phase.rates.start > 0.0;
        let found: Vec<_> = tasks
            .par_chunks(BATCH)
            .map(|tasks| self.batch(values, &pattern, &centres, tasks, refines))
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
        gradient.pattern = pattern.gradient_by_logits(|sample| by_angles[sample]);
        (loss, gradient)
    }

    fn fitness(&self, values: &Groups<Vec<f32>>, _: &Phase) -> f32 {
        self.judge(values)
    }

    fn judge(&self, values: &Groups<Vec<f32>>) -> f32 {
        mean(&self.losses(self.validation, values, usize::MAX))
    }

    fn expected(&self, values: &Groups<Vec<f32>>) -> Expected {
        let losses = self.losses(self.validation, values, usize::MAX);
        Expected::new(mean(&losses), losses.iter().copied().map(f64::from))
    }
}

/// The reach of a start's first weights.
const FIRST_OFFSETS: f32 = 0.02;

fn mean(losses: &[f32]) -> f32 {
    losses.iter().sum::<f32>() / losses.len() as f32
}
