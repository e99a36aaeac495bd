//! A complete training run, from materials to the content of a recipe.

use std::marker::PhantomData;

use glimpse_core::section::MAX_SAMPLES;
use glimpse_kernels::LaneModel;
use glimpse_kernels::with_model;
use glimpse_materials::basis::Basis;
use glimpse_materials::sampling::uniform_valid;
use glimpse_materials::{Identity, Material, SourceShare};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::checkpoint::CheckpointError;
use super::completion::any_directions;
use super::completion::highlight_warp::HighlightWarp;
use super::completion::pool::WarpedPool;
use super::completion::refinement::{GaussNewtonRefinement, Refinement};
use super::completion::train::{self, GAUSS_NEWTON_STEPS};
use super::descent::DescentObjective;
use super::learned::{
    LearnedFit, LearnedRecipe, LearnedRidge, LearnedSgd, ValidatedLoss, ValidationSplit,
};
use super::objective::{PaperObjective, RandomStreams};
use super::options::{Options, OptionsError};
use super::outer::{Observer, OuterLoop, RunError};
use super::pattern::angles_above_horizon;
use super::phase::Values;
use super::plan::{Schedule, TrainedParts};
use super::ridge::RidgeObjective;
use super::scan_budget::ScanBudgetError;
use super::schedules::paper;
use crate::linear::{Columns, ComponentsAt, principal_components};

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
    /// The materials have no variances.
    #[error("the training materials are too few or all the same; give more of them")]
    TooFewMaterials,
    /// The number of samples, n, is out of range.
    #[error("the number of samples is {0}; choose 1 to {max}, or any with the schedule prior", max = MAX_SAMPLES)]
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
    /// Schedule prior trains all parts, and Linear has nothing to train without a pattern.
    #[error("the parts \"{}\" cannot be trained with these options; choose \"all\"", .0.name())]
    Parts(TrainedParts),
    /// The options are invalid.
    #[error(transparent)]
    Options(#[from] OptionsError),
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
    let is_any = options.samples == 0 && options.schedule == Schedule::Prior;
    if !is_any && !(1..=MAX_SAMPLES).contains(&options.samples) {
        return Err(TrainError::Samples(options.samples));
    }
    if options.schedule == Schedule::Prior && options.parts != TrainedParts::All {
        return Err(TrainError::Parts(options.parts));
    }
    options.completion_options.validate(options.samples)?;
    check_source_shares(&options.source_shares, materials.len())?;
    // Run on a thread of the rayon pool: other threads would pass each parallel loop to the pool and wait.
    rayon::scope(|_| {
        if options.schedule == Schedule::Prior {
            return train_completion(options, materials, observer);
        }
        with_model!(
            options.model,
            M => train_sgd::<M>(options, materials, observer),
            _ => train_ridge(options, materials, observer),
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
    let train = |refinement: Option<&dyn Refinement>| match options.samples {
        0 => any_directions::train(options, refinement, materials, observer),
        _ => train::train(options, refinement, materials, observer).map(Some),
    };
    let learned = with_model!(
        options.model,
        M => train(Some(&GaussNewtonRefinement::<M>::new(GAUSS_NEWTON_STEPS))),
        _ => train(None),
    );
    learned?.ok_or(TrainError::TooFewMaterials)
}

/// Runs schedule paper on an objective with a number of materials.
fn run(
    options: &Options,
    identities: &[Identity],
    objective: &dyn PaperObjective,
    tasks: usize,
    observer: &mut Observer<'_>,
) -> Result<Values, TrainError> {
    let outer_loop = OuterLoop {
        initial: objective.initial_values(),
        phases: &paper::phases(objective, options, tasks),
        path: None,
        identity: options.identity(identities),
        checkpoints: options.checkpoints.as_ref(),
        stage: 0,
    };
    Ok(outer_loop.run(observer)?)
}

fn identities(materials: &[Box<dyn Material>]) -> Vec<Identity> {
    let identities = materials.iter().map(|each| Identity::new(&**each));
    identities.collect()
}

/// Trains SGD steps with schedule paper. A tenth of the materials is held out.
fn train_sgd<M: LaneModel>(
    options: &Options,
    materials: Vec<Box<dyn Material>>,
    observer: &mut Observer<'_>,
) -> Result<LearnedRecipe, TrainError> {
    let seed = options.seed;
    let identities = identities(&materials);
    let (training, validation) = split(materials, seed);
    let tasks = training.len();
    let pool = |materials: Vec<Box<dyn Material>>, size, seed| {
        let warps = [HighlightWarp::IDENTITY];
        WarpedPool::new(materials.into(), 0, &warps, uniform_valid(size, seed))
    };
    let training = pool(training, POOL, seed);
    let (held_out, split) = match validation.is_empty() {
        true => (None, ValidationSplit::Training),
        false => (
            Some(pool(validation, VALIDATION_POOL, !seed)),
            ValidationSplit::HeldOut,
        ),
    };
    let objective = DescentObjective::<M> {
        training: &training,
        validation: held_out.as_ref().unwrap_or(&training),
        pretrained: options
            .pretrained
            .as_ref()
            .filter(|_| options.parts == TrainedParts::PatternOnly),
        inner_steps: INNER_STEPS,
        streams: RandomStreams { seed },
        model: PhantomData,
    };
    let values = run(options, &identities, &objective, tasks, observer)?;
    let estimate = objective.expected_loss(&values);
    Ok(LearnedRecipe {
        pattern: angles_above_horizon(&values.pattern),
        fit: LearnedFit::Sgd(LearnedSgd {
            model: M::KIND,
            steps: INNER_STEPS,
            initial: values.initial,
            step_sizes: values.hyperparameters,
        }),
        loss_predictor: None,
        basis: None,
        expected_loss: Some(ValidatedLoss { estimate, split }),
        materials: identities,
    })
}

/// Trains the pattern of the model Linear with schedule paper.
fn train_ridge(
    options: &Options,
    materials: Vec<Box<dyn Material>>,
    observer: &mut Observer<'_>,
) -> Result<LearnedRecipe, TrainError> {
    let (prior, seed, tasks) = (options.prior, options.seed, materials.len());
    let identities = identities(&materials);
    // In random order; folds leave materials out instead.
    let (mut materials, mut held_out) = split(materials, seed);
    materials.append(&mut held_out);
    let columns = Columns::new(&materials);
    let objective = RidgeObjective::new(materials, &columns, prior, seed);
    let values = run(options, &identities, &objective, tasks, observer)?;

    let all: Vec<usize> = (0..columns.count()).collect();
    let basis = principal_components(&columns, &all, objective.components());
    let bytes = basis.to_bytes();
    let pattern = angles_above_horizon(&values.pattern);
    let at = ComponentsAt::new(&basis, pattern.clone());
    let precision = vec![prior.eta; basis.components()];
    let ridge = LearnedRidge::new(at, &precision, Basis::checksum(&bytes));
    Ok(LearnedRecipe {
        pattern,
        fit: LearnedFit::Ridge {
            net: None,
            ridge,
            refinement: None,
        },
        loss_predictor: None,
        basis: Some(bytes),
        expected_loss: Some(ValidatedLoss {
            estimate: objective.expected_loss(&values),
            // A single material is trained with its own basis.
            split: match identities.len() {
                1 => ValidationSplit::Training,
                _ => ValidationSplit::LeftOut,
            },
        }),
        materials: identities,
    })
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
