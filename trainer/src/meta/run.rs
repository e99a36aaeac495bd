//! A whole training run: from materials to what a recipe holds.

use std::marker::PhantomData;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use glimpse_core::angles::{Angles, HalfDifference};
use glimpse_core::model::ModelKind;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::checkpoint::{Best, Checkpoint, CheckpointError};
use super::gradient::LaneModel;
use super::parameters::{Groups, Optimization};
use super::pattern::{Pattern, logits_of};
use super::plan::{Effort, Plan, Schedule};
use super::pool::{Pool, Variation};
use super::start::first_guess;
use super::training::{InnerSamples, Start, StepSizeForm, Tasks, Training};
use super::unroll::Learner;
use crate::material::Material;
use crate::sampling::sobol_valid;
use crate::with_model;

/// SGD steps of the inner loop (paper: 20).
pub const INNER_STEPS: usize = 20;
/// Directions at which training materials are evaluated once.
const POOL: usize = 32_768;
/// The same for materials held out for validation.
const VALIDATION_POOL: usize = 4_096;
/// How often a phase is judged on materials that it does not train on.
const VALIDATIONS: usize = 20;
/// How often a checkpoint is written.
const CHECKPOINT_INTERVAL: Duration = Duration::from_secs(10);

/// What to train.
#[derive(Clone, Debug)]
pub struct Options {
    /// The model.
    pub model: ModelKind,
    /// n.
    pub samples: usize,
    /// How.
    pub schedule: Schedule,
    /// How long.
    pub effort: Effort,
    /// Stop before the pattern is trained, as the method Meta does.
    pub without_pattern: bool,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Where to keep checkpoints.
    pub checkpoint: Option<PathBuf>,
    /// Go on from the checkpoint.
    pub resume: bool,
}

impl Options {
    /// All that decides the outcome, in words: two runs with the same words give the same bytes.
    fn run(&self, materials: &[Box<dyn Material>]) -> String {
        let names: Vec<&str> = materials.iter().map(|material| material.name()).collect();
        format!(
            "{} n={} {:?} {:?} pattern={} seed={} {} materials {:08x}",
            self.model,
            self.samples,
            self.schedule,
            self.effort,
            !self.without_pattern,
            self.seed,
            names.len(),
            crc(names.join("\n").as_bytes()),
        )
    }
}

fn crc(bytes: &[u8]) -> u32 {
    crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(bytes)
}

/// What was learned.
#[derive(Clone, Debug, PartialEq)]
pub struct Learned {
    /// The model.
    pub model: ModelKind,
    /// K.
    pub inner_steps: usize,
    /// Where to measure; both directions of each sample are above the horizon.
    pub pattern: Vec<Angles<f32>>,
    /// theta_0.
    pub initial: Vec<f32>,
    /// alpha.
    pub step_sizes: Vec<f32>,
    /// Mean loss over the materials held out for validation (with fewer than ten materials none
    /// are, and it is over those of training).
    pub expected_loss: f32,
    /// How many materials it was trained on.
    pub materials: usize,
}

/// How far a run is.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// What is being trained.
    pub phase: &'static str,
    /// Outer steps done, over all phases.
    pub done: usize,
    /// Outer steps of all phases.
    pub total: usize,
    /// Outer loss, smoothed over some fifty steps.
    pub loss: f32,
    /// The best validation loss so far.
    pub validation: Option<f32>,
}

/// Why a run ended without a result.
#[derive(Debug, thiserror::Error)]
pub enum TrainError {
    /// Nothing to learn from.
    #[error("there are no materials to train on")]
    NoMaterials,
    /// n is out of range.
    #[error("{0} samples are out of range: a pattern has 1 to {max}", max = glimpse_core::recipe::MAX_SAMPLES)]
    Samples(usize),
    /// The model has nothing that descends.
    #[error("the model {0} is not fitted by descent: it has no start and step sizes to learn")]
    Model(ModelKind),
    /// A checkpoint cannot be written or read.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// The observer asked to stop; a checkpoint was written if there is a place for it.
    #[error("stopped after {0} outer steps")]
    Stopped(usize),
}

/// Trains, telling `observer` after every outer step.
///
/// The outcome depends on the options and the materials only, not on the number of threads, nor
/// on how often the run was stopped and resumed.
///
/// # Errors
/// See [`TrainError`].
pub fn train(
    options: &Options,
    materials: Vec<Box<dyn Material>>,
    observer: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Learned, TrainError> {
    if materials.is_empty() {
        return Err(TrainError::NoMaterials);
    }
    if !(1..=glimpse_core::recipe::MAX_SAMPLES).contains(&options.samples) {
        return Err(TrainError::Samples(options.samples));
    }
    with_model!(
        options.model,
        M => Run::<M>::new(options, materials).finish(observer),
        _ => Err(TrainError::Model(options.model)),
    )
}

/// A run under way.
struct Run<'o, M: LaneModel> {
    options: &'o Options,
    plan: Plan,
    name: String,
    training: Vec<Box<dyn Material>>,
    validation: Vec<Box<dyn Material>>,
    model: PhantomData<M>,
}

impl<'o, M: LaneModel> Run<'o, M> {
    fn new(options: &'o Options, materials: Vec<Box<dyn Material>>) -> Self {
        let name = options.run(&materials);
        let (training, validation) = split(materials, options.seed);
        let mut plan = Plan::new(
            options.schedule,
            options.effort,
            options.model,
            options.samples,
            training.len(),
        );
        if options.without_pattern {
            plan = plan.without_pattern(options.samples);
        }
        Self {
            options,
            plan,
            name,
            training,
            validation,
            model: PhantomData,
        }
    }

    fn first_values(&self, guess: u64) -> Groups<Vec<f32>> {
        let seed = self.options.seed.wrapping_add(guess << 32);
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let initial = first_guess(self.options.model, &mut random);
        let step_size = self.plan.step_size_form.value(self.plan.first_step_size);
        let pattern = sobol_valid(self.options.samples, (seed ^ (seed >> 32)) as u32);
        Groups {
            step_sizes: vec![step_size; initial.len()],
            initial,
            pattern: pattern.into_iter().flat_map(logits_of).collect(),
        }
    }

    fn finish(
        self,
        observer: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Learned, TrainError> {
        let directory = self.options.checkpoint.as_deref();
        let mut optimization = Optimization::new(self.first_values(0));
        let mut done = 0;
        let mut loss = 0.0;
        let mut best: Option<Best> = None;
        if let Some(directory) = directory {
            Checkpoint::prepare(directory)?;
            if self.options.resume {
                let checkpoint = Checkpoint::read(directory, &self.name)?;
                optimization = optimization
                    .restore(checkpoint.record)
                    .map_err(|error| CheckpointError::Record(error.to_string()))?;
                (done, loss, best) = (checkpoint.done, checkpoint.loss, checkpoint.best);
            }
        }

        let tasks = Tasks {
            pool: Pool::new(&self.training, POOL, self.options.seed),
            materials: &self.training,
        };
        let judged = match self.validation.is_empty() {
            true => &self.training,
            false => &self.validation,
        };
        let judge = Judge {
            materials: judged,
            pool: Pool::new(judged, VALIDATION_POOL, !self.options.seed),
            form: self.plan.step_size_form,
        };
        let mut training = Training::<M> {
            tasks: &tasks,
            phases: &self.plan.phases,
            inner_steps: INNER_STEPS,
            seed: self.options.seed,
            step_size_form: self.plan.step_size_form,
            optimization,
            model: PhantomData,
        };
        let save = |training: &Training<'_, M>, done, loss, best: &Option<Best>| {
            let Some(directory) = directory else {
                return Ok(());
            };
            let record = training.optimization.record();
            Checkpoint {
                run: self.name.clone(),
                done,
                loss,
                best: best.clone(),
                record: record.map_err(|error| CheckpointError::Record(error.to_string()))?,
            }
            .write(directory)
        };

        let total = self.plan.steps();
        let mut saved = Instant::now();
        let mut before = 0;
        for (index, phase) in self.plan.phases.iter().enumerate() {
            if done == before {
                match (phase.start, &best) {
                    (Start::Guess(guess), _) => {
                        training.optimization = Optimization::new(self.first_values(guess));
                    }
                    (Start::Best, Some(best)) => {
                        training.optimization = Optimization::new(best.values.clone());
                    }
                    _ => {}
                }
            }
            // What could be a recipe is judged: in phases on n samples, and at the end.
            let of_n = [
                InnerSamples::Pattern,
                InnerSamples::Random(self.options.samples),
            ];
            let is_judged = of_n.contains(&phase.inner) || index + 1 == self.plan.phases.len();
            while done < before + phase.steps {
                let step = done - before;
                let found = training.step(index, step);
                done += 1;
                let share = if done == 1 { 1.0 } else { 0.02 };
                loss += share * (found - loss);
                let period = phase.steps.div_ceil(VALIDATIONS);
                if is_judged && ((step + 1) % period == 0 || step + 1 == phase.steps) {
                    let values = training.optimization.values();
                    let found = judge.loss::<M>(&values);
                    if best.as_ref().is_none_or(|best| found < best.loss) {
                        best = Some(Best {
                            loss: found,
                            values,
                        });
                    }
                }
                let progress = Progress {
                    phase: phase.name,
                    done,
                    total,
                    loss,
                    validation: best.as_ref().map(|best| best.loss),
                };
                let stop = observer(&progress).is_break();
                if stop || saved.elapsed() > CHECKPOINT_INTERVAL {
                    save(&training, done, loss, &best)?;
                    saved = Instant::now();
                }
                if stop && done < total {
                    return Err(TrainError::Stopped(done));
                }
            }
            before += phase.steps;
        }
        save(&training, done, loss, &best)?;
        // None only if no judged loss was a number; the recipe's checks will then say so.
        let Best { loss, values } = best.unwrap_or_else(|| Best {
            loss,
            values: training.optimization.values(),
        });
        Ok(Learned {
            model: self.options.model,
            inner_steps: INNER_STEPS,
            pattern: above_horizon(&values.pattern),
            initial: values.initial,
            step_sizes: self.plan.step_size_form.step_sizes(&values.step_sizes),
            expected_loss: loss,
            materials: self.training.len() + self.validation.len(),
        })
    }
}

/// Holds out every tenth material of a shuffled order; none of fewer than ten.
#[expect(clippy::type_complexity, reason = "two lists of materials")]
fn split(
    mut materials: Vec<Box<dyn Material>>,
    seed: u64,
) -> (Vec<Box<dyn Material>>, Vec<Box<dyn Material>>) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(u64::MAX);
    materials.shuffle(&mut random);
    let held_out = materials.len() / 10;
    let validation = materials.split_off(materials.len() - held_out);
    (materials, validation)
}

/// The pattern's angles, pulled towards the pole where a direction is below the horizon or grazes
/// it: a scanner cannot measure there.
fn above_horizon(logits: &[f32]) -> Vec<Angles<f32>> {
    const LEAST_COSINE: f32 = 1e-3;
    let mut angles = Pattern::from_logits(logits).angles().to_vec();
    for angles in &mut angles {
        loop {
            let at = HalfDifference::from_angles(*angles);
            if at.cos_theta_i().min(at.cos_theta_o()) > LEAST_COSINE {
                break;
            }
            angles.theta_h *= 0.99;
            angles.theta_d *= 0.99;
        }
    }
    angles
}

/// Judges meta-parameters by the mean loss that they lead to.
struct Judge<'a> {
    materials: &'a [Box<dyn Material>],
    pool: Pool,
    form: StepSizeForm,
}

impl Judge<'_> {
    fn loss<M: LaneModel>(&self, values: &Groups<Vec<f32>>) -> f32 {
        use rayon::prelude::*;
        let step_sizes = self.form.step_sizes(&values.step_sizes);
        let learner = Learner::<M, f32>::new(&values.initial, &step_sizes, INNER_STEPS);
        let pattern = Pattern::new(above_horizon(&values.pattern));
        let losses: Vec<f32> = self
            .materials
            .par_iter()
            .enumerate()
            .map(|(index, material)| {
                let measured = pattern.measure(&**material, Variation::NONE);
                let parameters = learner.learn(&measured.octets());
                M::loss(&parameters, &self.pool.all(index).octets())
            })
            .collect();
        losses.iter().sum::<f32>() / losses.len() as f32
    }
}
