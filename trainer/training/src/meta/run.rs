//! A complete training run, from materials to the content of a recipe.

use std::marker::PhantomData;

use glimpse_core::model::ModelKind;
use glimpse_core::section::{MAX_PRECISION, MAX_SAMPLES, MIN_PRECISION};
use glimpse_kernels::LaneModel;
use glimpse_kernels::with_model;
use glimpse_materials::basis::Basis;
use glimpse_materials::{Identity, Material, SourceShare};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::checkpoint::CheckpointError;
use super::completion::refinement::{GaussNewtonRefinement, Refinement};
use super::completion::train::{self, GAUSS_NEWTON_STEPS};
use super::descent::{DescentObjective, TaskSet};
use super::identity::RunIdentity;
use super::learned::{
    LearnedFit, LearnedRecipe, LearnedRidge, LearnedSgd, ValidatedLoss, ValidationSplit,
};
use super::linear::LinearObjective;
use super::objective::{MetaObjective, RandomStreams};
use super::options::{CompletionOptionsError, Options};
use super::outer::{Observer, Outcome, OuterLoop, RunError};
use super::pattern::angles_above_horizon;
use super::plan::{Plan, Schedule, TrainedParts};
use super::pool::Pool;
use super::scan_budget::ScanBudgetError;
use crate::linear::Columns;
use crate::linear::principal_components;

/// The number of SGD steps of the inner loop (paper: 20).
pub const INNER_STEPS: usize = 20;
/// The number of pool directions of training materials.
const POOL: usize = 32_768;
/// The number of pool directions of validation materials.
const VALIDATION_POOL: usize = 4_096;

/// The training ended without a result.
#[derive(Debug, thiserror::Error)]
pub enum TrainError {
    /// The list of materials is empty.
    #[error("the list of training materials is empty; name at least one material")]
    NoMaterials,
    /// The number of samples, n, is out of range.
    #[error("the number of samples is {0}; choose 1 to {max}", max = MAX_SAMPLES)]
    Samples(usize),
    /// Source shares do not match the materials, or are not positive numbers with sum 1.
    #[error(
        "the source shares cover {source_shares} materials, but {materials} were given; list each source with its \
         number of materials and a share above 0, with a sum of 1"
    )]
    SourceShares {
        /// The number of materials of all sources.
        source_shares: usize,
        /// The number of materials.
        materials: usize,
    },
    /// The options of schedule prior are invalid.
    #[error(transparent)]
    CompletionOptions(#[from] CompletionOptionsError),
    /// The budget for the time of a scan is impossible.
    #[error(transparent)]
    ScanBudget(#[from] ScanBudgetError),
    /// A checkpoint cannot be written or read.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// The observer stopped the run. With checkpoints, the state was saved.
    #[error("stopped after {0} outer steps")]
    Stopped(usize),
}

impl From<RunError> for TrainError {
    fn from(error: RunError) -> Self {
        match error {
            RunError::Checkpoint(error) => Self::Checkpoint(error),
            RunError::ScanBudget(error) => Self::ScanBudget(error),
            RunError::Stopped(done) => Self::Stopped(done),
        }
    }
}

/// Trains a recipe, calling `observer` after each outer step.
///
/// The result depends only on the options and the materials. The number of threads, and stopping and resuming, do not
/// change it.
///
/// # Errors
/// See [`TrainError`].
pub fn train(
    options: &Options,
    materials: Vec<Box<dyn Material>>,
    observer: &mut Observer<'_>,
) -> Result<LearnedRecipe, TrainError> {
    if materials.is_empty() {
        return Err(TrainError::NoMaterials);
    }
    if !(1..=MAX_SAMPLES).contains(&options.samples) {
        return Err(TrainError::Samples(options.samples));
    }
    options.completion_options.validate()?;
    if let Some(scan) = &options.completion_options.scan {
        scan.validate(options.completion_options.limits, options.samples)?;
    }
    check_source_shares(&options.source_shares, materials.len())?;
    // Run on a thread of the rayon pool: other threads would pass each parallel loop to the pool and wait.
    rayon::scope(|_| {
        if options.schedule == Schedule::Prior {
            return train_completion(options, materials, observer);
        }
        let session = Session::new(options, materials);
        with_model!(
            options.model,
            M => session.descent::<M>(observer),
            _ => session.ridge(observer),
        )
    })
}

/// Checks that the sources cover all materials, and that all shares are positive and have the sum 1.
fn check_source_shares(source_shares: &[SourceShare], materials: usize) -> Result<(), TrainError> {
    let count: usize = source_shares
        .iter()
        .map(|source_share| source_share.materials)
        .sum();
    let sum: f32 = source_shares
        .iter()
        .map(|source_share| source_share.share)
        .sum();
    let is_positive =
        |source_share: &SourceShare| source_share.materials > 0 && source_share.share > 0.0;
    let is_valid =
        count == materials && (sum - 1.0).abs() < 1e-3 && source_shares.iter().all(is_positive);
    match is_valid || source_shares.is_empty() {
        true => Ok(()),
        false => Err(TrainError::SourceShares {
            source_shares: count,
            materials,
        }),
    }
}

/// Trains a recipe with schedule prior.
fn train_completion(
    options: &Options,
    materials: Vec<Box<dyn Material>>,
    observer: &mut Observer<'_>,
) -> Result<LearnedRecipe, TrainError> {
    let plan = plan_of(options, materials.len());
    let train = |refinement: Option<&dyn Refinement>| {
        train::train(options, &plan, refinement, materials, observer)
    };
    let learned = with_model!(
        options.model,
        M => train(Some(&GaussNewtonRefinement::<M>::new(GAUSS_NEWTON_STEPS))),
        _ => train(None),
    );
    Ok(learned?)
}

/// Returns the plan of a run on a number of materials.
fn plan_of(options: &Options, materials: usize) -> Plan {
    let (schedule, effort) = (options.schedule, options.effort);
    let plan = Plan::new(schedule, effort, options.model, options.samples, materials);
    let plan = match options.parts {
        TrainedParts::All => plan,
        TrainedParts::AllTwice => plan.twice(),
        TrainedParts::WithoutPattern => plan.without_pattern(options.samples),
        TrainedParts::PatternOnly => plan.pattern_only(options.pretrained.clone()),
    };
    match options.model == ModelKind::Linear && options.prior.eta.is_some() {
        true => plan.without_step_sizes(),
        false => plan,
    }
}

/// The state of a training with schedule joint or paper.
struct Session<'o> {
    options: &'o Options,
    identity: RunIdentity,
    plan: Plan,
    /// The identities of all materials, in the original order.
    identities: Vec<Identity>,
    training: Vec<Box<dyn Material>>,
    validation: Vec<Box<dyn Material>>,
}

impl<'o> Session<'o> {
    fn new(options: &'o Options, materials: Vec<Box<dyn Material>>) -> Self {
        let identities: Vec<Identity> = materials
            .iter()
            .map(|each| Identity::new(&**each))
            .collect();
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

    /// Returns the materials held out, or the training materials if none are held out.
    fn validation_materials(&self) -> &[Box<dyn Material>] {
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

    /// Runs the outer loop. Returns the best values and their loss.
    fn run(
        &self,
        objective: &dyn MetaObjective,
        observer: &mut Observer<'_>,
    ) -> Result<Outcome, TrainError> {
        let outer_loop = OuterLoop {
            objective,
            plan: &self.plan,
            identity: self.identity,
            seed: self.options.seed,
            checkpoints: self.options.checkpoints.clone(),
            stage: 0,
        };
        Ok(outer_loop.run(observer)?)
    }

    fn descent<M: LaneModel>(
        &self,
        observer: &mut Observer<'_>,
    ) -> Result<LearnedRecipe, TrainError> {
        let seed = self.options.seed;
        let tasks = |materials, size, seed| TaskSet {
            pool: Pool::new(materials, size, seed),
            materials,
        };
        let objective = DescentObjective::<M> {
            training: &tasks(&self.training, POOL, seed),
            validation: &tasks(self.validation_materials(), VALIDATION_POOL, !seed),
            plan: &self.plan,
            inner_steps: INNER_STEPS,
            streams: RandomStreams { seed },
            model: PhantomData,
        };
        let Outcome {
            expected_loss,
            values,
        } = self.run(&objective, observer)?;
        Ok(LearnedRecipe {
            pattern: angles_above_horizon(&values.pattern),
            fit: LearnedFit::Sgd(LearnedSgd {
                model: M::KIND,
                steps: INNER_STEPS,
                initial: values.initial,
                step_sizes: self.plan.step_size_encoding.decode(&values.hyperparameters),
            }),
            loss_predictor: None,
            basis: None,
            expected_loss: ValidatedLoss {
                estimate: expected_loss,
                split: self.split(),
            },
            materials: self.identities.clone(),
        })
    }

    /// Trains the model Linear. No materials are held out: each is trained with the basis of other folds.
    fn ridge(mut self, observer: &mut Observer<'_>) -> Result<LearnedRecipe, TrainError> {
        self.training.append(&mut self.validation);
        let columns = Columns::new(&self.training);
        let (prior, seed) = (self.options.prior, self.options.seed);
        let objective = LinearObjective::new(&self.training, &columns, prior, &self.plan, seed);
        let Outcome {
            expected_loss,
            values,
        } = self.run(&objective, observer)?;

        let all: Vec<usize> = (0..columns.count()).collect();
        let basis = principal_components(&columns, &all, objective.components());
        let bytes = basis.to_bytes();
        let pattern = angles_above_horizon(&values.pattern);
        // The precision of an unconstrained or unused coefficient may exceed the range of recipes.
        let precision = |log: &f32| log.exp().clamp(MIN_PRECISION, MAX_PRECISION);
        let precision: Vec<f32> = values.hyperparameters.iter().map(precision).collect();
        let checksum = Basis::checksum(&bytes);
        let ridge = LearnedRidge::new(&basis, &pattern, &precision, checksum);
        Ok(LearnedRecipe {
            pattern,
            fit: LearnedFit::Ridge {
                net: None,
                ridge,
                refinement: None,
            },
            loss_predictor: None,
            basis: Some(bytes),
            expected_loss: ValidatedLoss {
                estimate: expected_loss,
                // A single material is trained with its own basis.
                split: match self.identities.len() {
                    1 => ValidationSplit::Training,
                    _ => ValidationSplit::LeftOut,
                },
            },
            materials: self.identities,
        })
    }
}

/// Holds out a tenth of the shuffled materials, rounded down.
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
