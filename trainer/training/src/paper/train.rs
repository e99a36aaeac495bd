//! Training with schedule paper.

use glimpse_core::fit::Sgd;
use glimpse_core::recipe::Contents;
use glimpse_fitting::linear::ComponentsAt;
use glimpse_fitting::recipe::expected_loss::{ValidatedLoss, ValidationSplit};
use glimpse_fitting::recipe::options::{TrainedParts, TrainingOptions};
use glimpse_fitting::recipe::sections::{Arena, count};
use glimpse_kernels::ModelKernels;
use glimpse_materials::basis::Basis;
use glimpse_materials::sampling::uniform_valid;
use glimpse_materials::{Identity, Material};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::descent::DescentObjective;
use super::objective::PaperObjective;
use super::phases::phases;
use super::ridge::RidgeObjective;
use crate::learned::Learned;
use crate::linear::{Columns, principal_components};
use crate::outer::{Checkpoints, Observer, OuterLoop, RunError};
use crate::pattern::angles_above_horizon;
use crate::phase::Values;
use crate::streams::RandomStreams;
use crate::tasks::pool::WarpedPool;

/// The number of SGD steps of the inner loop (paper: 20).
pub const INNER_STEPS: usize = 20;
/// The number of pool directions of training materials.
const POOL: usize = 32_768;
/// The number of pool directions of validation materials.
const VALIDATION_POOL: usize = 4_096;

/// Trains a recipe.
///
/// # Errors
/// If the run is stopped, or a checkpoint cannot be read or written.
pub(crate) fn train<'a>(
    arena: &'a Arena,
    options: &TrainingOptions,
    materials: Vec<Box<dyn Material>>,
    checkpoints: Option<&Checkpoints>,
    observer: &mut Observer<'_>,
) -> Result<Learned<'a>, RunError> {
    match ModelKernels::of(options.model) {
        Some(kernels) => train_sgd(arena, kernels, options, materials, checkpoints, observer),
        None => train_ridge(arena, options, materials, checkpoints, observer),
    }
}

/// Runs schedule paper on an objective with a number of materials.
fn run(
    options: &TrainingOptions,
    checkpoints: Option<&Checkpoints>,
    identities: &[Identity],
    objective: &dyn PaperObjective,
    tasks: usize,
    observer: &mut Observer<'_>,
) -> Result<Values, RunError> {
    let outer_loop = OuterLoop {
        initial: objective.initial_values(),
        phases: &phases(objective, options, tasks),
        path: None,
        identity: options.identity(identities),
        checkpoints,
        stage: 0,
    };
    outer_loop.run(observer)
}

/// Trains SGD steps with schedule paper. A tenth of the materials is held out.
fn train_sgd<'a>(
    arena: &'a Arena,
    kernels: &'static ModelKernels,
    options: &TrainingOptions,
    materials: Vec<Box<dyn Material>>,
    checkpoints: Option<&Checkpoints>,
    observer: &mut Observer<'_>,
) -> Result<Learned<'a>, RunError> {
    let seed = options.seed;
    let identities = Identity::list(&materials);
    let (training, validation) = split(materials, seed);
    let tasks = training.len();
    let pool = |materials: Vec<Box<dyn Material>>, size, seed| {
        WarpedPool::new(materials.into(), 0, uniform_valid(size, seed))
    };
    let training = pool(training, POOL, seed);
    let (held_out, split) = if validation.is_empty() {
        (None, ValidationSplit::Training)
    } else {
        let pool = pool(validation, VALIDATION_POOL, !seed);
        (Some(pool), ValidationSplit::HeldOut)
    };
    let objective = DescentObjective {
        kernels,
        training: &training,
        validation: held_out.as_ref().unwrap_or(&training),
        pretrained: match &options.parts {
            TrainedParts::PatternOnly(pretrained) => pretrained.as_ref(),
            _ => None,
        },
        inner_steps: INNER_STEPS,
        streams: RandomStreams { seed },
    };
    let values = run(
        options,
        checkpoints,
        &identities,
        &objective,
        tasks,
        observer,
    )?;
    let estimate = objective.expected_loss(&values);
    Ok(Learned {
        pattern: angles_above_horizon(&values.pattern),
        fit: Contents {
            sgd: Some(Sgd {
                model: options.model,
                steps: count(INNER_STEPS),
                initial: arena.floats(&values.initial),
                step_sizes: arena.floats(&values.hyperparameters),
            }),
            ..Contents::default()
        },
        loss_predictor: None,
        basis: None,
        expected_loss: Some(ValidatedLoss { estimate, split }),
        materials: identities,
    })
}

/// Trains the pattern of the model Linear with schedule paper.
fn train_ridge<'a>(
    arena: &'a Arena,
    options: &TrainingOptions,
    materials: Vec<Box<dyn Material>>,
    checkpoints: Option<&Checkpoints>,
    observer: &mut Observer<'_>,
) -> Result<Learned<'a>, RunError> {
    let (eta, seed, tasks) = (options.eta, options.seed, materials.len());
    let identities = Identity::list(&materials);
    // In random order; folds leave materials out instead.
    let (mut materials, mut held_out) = split(materials, seed);
    materials.append(&mut held_out);
    let columns = Columns::new(&materials);
    let objective = RidgeObjective::new(materials, &columns, options.bases, eta, seed);
    let values = run(
        options,
        checkpoints,
        &identities,
        &objective,
        tasks,
        observer,
    )?;

    let all: Vec<usize> = (0..columns.count()).collect();
    let basis = principal_components(&columns, &all, objective.components());
    let bytes = basis.to_bytes();
    let pattern = angles_above_horizon(&values.pattern);
    let at = ComponentsAt::new(&basis, pattern.clone());
    let precision = vec![eta; basis.components()];
    Ok(Learned {
        pattern,
        fit: Contents {
            ridge: Some(arena.ridge(&at, &precision, Basis::checksum(&bytes))),
            ..Contents::default()
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
