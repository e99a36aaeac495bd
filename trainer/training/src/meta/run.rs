//! A whole training run: from materials to what a recipe holds.

use std::marker::PhantomData;

use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{MAX_PRECISION, MIN_PRECISION, ValidationSplit};
use glimpse_kernels::LaneModel;
use glimpse_kernels::with_model;
use glimpse_materials::basis::Basis;
use glimpse_materials::{Identity, Material, Portion};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::checkpoint::CheckpointError;
use super::completion::refinement::{Refinement, Steps};
use super::completion::train::{STARTED_STEPS, train as complete};
use super::descent::{DescentObjective, Tasks};
use super::identity::RunIdentity;
use super::learned::{Learned, LearnedDescent, LearnedFit, ValidatedLoss};
use super::linear::LinearObjective;
use super::objective::{MetaObjective, RandomStreams};
use super::options::{CompletionOptionsError, Options, Parts};
use super::outer::{Observer, Outcome, Run, RunError};
use super::pattern::above_horizon;
use super::plan::{Plan, Schedule};
use super::pool::Pool;
use crate::linear::principal_components;
use crate::linear::{Columns, ReducedBasis};

/// SGD steps of the inner loop (paper: 20).
pub const INNER_STEPS: usize = 20;
/// Directions at which training materials are evaluated once.
const POOL: usize = 32_768;
/// The same for materials held out for validation.
const VALIDATION_POOL: usize = 4_096;

/// Why a run ended without a result.
#[derive(Debug, thiserror::Error)]
pub enum TrainError {
    /// Nothing to learn from.
    #[error("there are no materials to train on")]
    NoMaterials,
    /// n is out of range.
    #[error("{0} samples are out of range: a pattern has 1 to {max}", max = glimpse_core::recipe::MAX_SAMPLES)]
    Samples(usize),
    /// Portions are not those of the materials, or their shares not positive numbers of a sum of 1.
    #[error(
        "portions of {portions} materials do not divide {materials}, each with a share above 0, 1 in all"
    )]
    Portions {
        /// How many materials all portions have.
        portions: usize,
        /// How many there are.
        materials: usize,
    },
    /// What a completion is to be trained on is not what one can be trained on.
    #[error(transparent)]
    CompletionOptions(#[from] CompletionOptionsError),
    /// A number of the finished recipe is no number.
    #[error("training did not converge: {0}")]
    Diverged(#[from] glimpse_core::fit::ridge::RidgeError),
    /// A checkpoint cannot be written or read.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// The observer asked to stop; a checkpoint was written if there is a place for it.
    #[error("stopped after {0} outer steps")]
    Stopped(usize),
}

impl From<RunError> for TrainError {
    fn from(error: RunError) -> Self {
        match error {
            RunError::Checkpoint(error) => Self::Checkpoint(error),
            RunError::Stopped(done) => Self::Stopped(done),
        }
    }
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
    observer: &mut Observer<'_>,
) -> Result<Learned, TrainError> {
    if materials.is_empty() {
        return Err(TrainError::NoMaterials);
    }
    if !(1..=glimpse_core::recipe::MAX_SAMPLES).contains(&options.samples) {
        return Err(TrainError::Samples(options.samples));
    }
    options.completion_options.validate()?;
    check(&options.portions, materials.len())?;
    // On one of rayon's own threads: each parallel loop would else be handed over to one.
    rayon::scope(|_| {
        if options.schedule == Schedule::Prior {
            return completed(options, materials, observer);
        }
        let session = Session::new(options, materials);
        with_model!(
            options.model,
            M => session.descent::<M>(observer),
            _ => session.ridge(observer),
        )
    })
}

/// Makes sure that every material is in a portion, and every portion is taken now and then.
fn check(portions: &[Portion], materials: usize) -> Result<(), TrainError> {
    let count: usize = portions.iter().map(|portion| portion.materials).sum();
    let sum: f32 = portions.iter().map(|portion| portion.share).sum();
    let each = |portion: &Portion| portion.materials > 0 && portion.share > 0.0;
    let right = count == materials && (sum - 1.0).abs() < 1e-3 && portions.iter().all(each);
    match right || portions.is_empty() {
        true => Ok(()),
        false => Err(TrainError::Portions {
            portions: count,
            materials,
        }),
    }
}

/// Readings completed, and a descent from there.
fn completed(
    options: &Options,
    materials: Vec<Box<dyn Material>>,
    observer: &mut Observer<'_>,
) -> Result<Learned, TrainError> {
    let plan = plan_of(options, materials.len());
    let train = |refinement: Option<&dyn Refinement>| {
        complete(options, &plan, refinement, materials, observer)
    };
    let learned = with_model!(
        options.model,
        M => train(Some(&Steps::<M>::new(STARTED_STEPS))),
        _ => train(None),
    );
    Ok(learned?)
}

/// The plan of a run on so many materials.
fn plan_of(options: &Options, materials: usize) -> Plan {
    let (schedule, effort) = (options.schedule, options.effort);
    let plan = Plan::new(schedule, effort, options.model, options.samples, materials);
    let plan = match &options.parts {
        Parts::All => plan,
        Parts::AllTwice => plan.twice(),
        Parts::WithoutPattern => plan.without_pattern(options.samples),
        Parts::PatternOnly(known) => plan.pattern_only(known.clone()),
    };
    match options.model == ModelKind::Linear && options.prior.eta.is_some() {
        true => plan.without_step_sizes(),
        false => plan,
    }
}

/// What the training by all other schedules needs.
struct Session<'o> {
    options: &'o Options,
    identity: RunIdentity,
    plan: Plan,
    /// Of all materials, in their own order.
    identities: Vec<Identity>,
    training: Vec<Box<dyn Material>>,
    validation: Vec<Box<dyn Material>>,
}

impl<'o> Session<'o> {
    fn new(options: &'o Options, materials: Vec<Box<dyn Material>>) -> Self {
        let identities: Vec<Identity> =
            materials.iter().map(|each| Identity::of(&**each)).collect();
        let identity = options.identity(&identities);
        let (training, validation) = split(materials, options.seed);
        let plan = plan_of(options, training.len());
        Self {
            options,
            identity,
            plan,
            identities,
            training,
            validation,
        }
    }

    /// The materials held out, or those of training if none are.
    fn judged(&self) -> &[Box<dyn Material>] {
        match self.validation.is_empty() {
            true => &self.training,
            false => &self.validation,
        }
    }

    fn split(&self) -> ValidationSplit {
        match self.validation.is_empty() {
            true => ValidationSplit::Training,
            false => ValidationSplit::HeldOut,
        }
    }

    /// Trains; returns the best values and their loss.
    fn finish(
        &self,
        objective: &dyn MetaObjective,
        observer: &mut Observer<'_>,
    ) -> Result<Outcome, TrainError> {
        let run = Run {
            objective,
            plan: &self.plan,
            identity: self.identity,
            seed: self.options.seed,
            checkpoints: self.options.checkpoints.clone(),
            stage: 0,
        };
        Ok(run.finish(observer)?)
    }

    fn descent<M: LaneModel>(&self, observer: &mut Observer<'_>) -> Result<Learned, TrainError> {
        let seed = self.options.seed;
        let tasks = |materials, size, seed| Tasks {
            pool: Pool::new(materials, size, seed),
            materials,
        };
        let objective = DescentObjective::<M> {
            training: &tasks(&self.training, POOL, seed),
            validation: &tasks(self.judged(), VALIDATION_POOL, !seed),
            plan: &self.plan,
            inner_steps: INNER_STEPS,
            streams: RandomStreams { seed },
            model: PhantomData,
        };
        let Outcome { expected, values } = self.finish(&objective, observer)?;
        Ok(Learned {
            pattern: above_horizon(&values.pattern),
            fit: LearnedFit::Descent(LearnedDescent {
                model: M::KIND,
                inner_steps: INNER_STEPS,
                initial: values.initial,
                step_sizes: self.plan.step_size_form.step_sizes(&values.hyperparameters),
            }),
            prediction: None,
            basis: None,
            expected_loss: ValidatedLoss {
                expected,
                split: self.split(),
            },
            materials: self.identities.clone(),
        })
    }

    /// Linear holds no materials out: each is learned on with a basis of others.
    fn ridge(mut self, observer: &mut Observer<'_>) -> Result<Learned, TrainError> {
        self.training.append(&mut self.validation);
        let columns = Columns::new(&self.training);
        let (prior, seed) = (self.options.prior, self.options.seed);
        let objective = LinearObjective::new(&self.training, &columns, prior, &self.plan, seed);
        let Outcome { expected, values } = self.finish(&objective, observer)?;

        let all: Vec<usize> = (0..columns.count()).collect();
        let basis = principal_components(&columns, &all, objective.components());
        let bytes = basis.to_bytes();
        let pattern = above_horizon(&values.pattern);
        let mut reduced = ReducedBasis::new(&basis, &pattern);
        // A coefficient that is left free, or held at 0, may run out of what recipes hold.
        let precision = |log: &f32| log.exp().clamp(MIN_PRECISION, MAX_PRECISION);
        reduced.precision = values.hyperparameters.iter().map(precision).collect();
        reduced.basis_checksum = Basis::checksum(&bytes);
        Ok(Learned {
            pattern,
            fit: LearnedFit::Ridge(reduced),
            prediction: None,
            basis: Some(bytes),
            expected_loss: ValidatedLoss {
                expected,
                // A single material has nothing to be left out of.
                split: match self.identities.len() {
                    1 => ValidationSplit::Training,
                    _ => ValidationSplit::LeftOut,
                },
            },
            materials: self.identities,
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
