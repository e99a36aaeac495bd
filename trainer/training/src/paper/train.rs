//! Training with schedule paper.

use glimpse_core::fit::Sgd;
use glimpse_core::recipe::Contents;
use glimpse_fitting::linear::{ComponentsAt, to_host_bytes};
use glimpse_fitting::recipe::expected_loss::{ValidatedLoss, ValidationSplit};
use glimpse_fitting::recipe::options::TrainedParts;
use glimpse_fitting::recipe::sections::count;
use glimpse_kernels::ModelKernels;
use glimpse_materials::Material;
use glimpse_materials::sampling::{random_stream, uniform_valid};
use rand::seq::SliceRandom;

use super::descent::DescentObjective;
use super::objective::PaperObjective;
use super::phases::phases;
use super::ridge::RidgeObjective;
use crate::job::Job;
use crate::linear::{Columns, principal_components};
use crate::pattern::Reach;
use crate::result::{Learned, TrainError};
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
pub(crate) fn train<'a>(job: Job<'a, '_>) -> Result<Learned<'a>, TrainError> {
    match ModelKernels::of(job.options.model) {
        Some(kernels) => train_sgd(kernels, job),
        None => train_ridge(job),
    }
}

/// Trains SGD steps with schedule paper. A tenth of the materials is held out.
fn train_sgd<'a>(
    kernels: &'static ModelKernels,
    mut job: Job<'a, '_>,
) -> Result<Learned<'a>, TrainError> {
    let seed = job.options.seed;
    let [training, validation] = split(job.materials, seed);
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
        pretrained: match &job.options.parts {
            TrainedParts::PatternOnly(pretrained) => pretrained.as_ref(),
            _ => None,
        },
        inner_steps: INNER_STEPS,
        streams: RandomStreams { seed },
    };
    let phases = phases(&objective, job.options, tasks);
    let values = job.session.run(objective.initial_values(), &phases, None)?;
    let estimate = objective.expected_loss(&values);
    Ok(Learned {
        pattern: Reach::ANY.reachable_angles(&values.pattern),
        fit: Contents {
            sgd: Some(Sgd {
                model: job.options.model,
                steps: count(INNER_STEPS),
                initial: job.arena.floats(&values.initial),
                step_sizes: job.arena.floats(&values.hyperparameters),
            }),
            ..Contents::default()
        },
        expected_loss: Some(ValidatedLoss { estimate, split }),
        ..Learned::default()
    })
}

/// Trains the pattern of the model Linear with schedule paper.
fn train_ridge<'a>(mut job: Job<'a, '_>) -> Result<Learned<'a>, TrainError> {
    let (eta, seed, tasks) = (job.options.eta, job.options.seed, job.materials.len());
    // In random order; folds leave materials out instead.
    let [mut materials, mut held_out] = split(job.materials, seed);
    materials.append(&mut held_out);
    let columns = Columns::new(&materials);
    let objective = RidgeObjective::new(materials, &columns, job.options.bases, eta, seed);
    let phases = phases(&objective, job.options, tasks);
    let values = job.session.run(objective.initial_values(), &phases, None)?;

    let all: Vec<usize> = (0..columns.count()).collect();
    let basis = principal_components(&columns, &all, objective.components());
    let pattern = Reach::ANY.reachable_angles(&values.pattern);
    let at = ComponentsAt::new(&basis, pattern.clone());
    let precision = vec![eta; basis.components()];
    Ok(Learned {
        pattern,
        fit: Contents {
            ridge: Some(job.arena.ridge(&at, &precision, basis.checksum())),
            ..Contents::default()
        },
        basis: Some(to_host_bytes(&basis)),
        expected_loss: Some(ValidatedLoss {
            estimate: objective.expected_loss(&values),
            // A single material is trained with its own basis.
            split: match tasks {
                1 => ValidationSplit::Training,
                _ => ValidationSplit::LeftOut,
            },
        }),
        ..Learned::default()
    })
}

/// Holds out a tenth of the shuffled materials, rounded down.
fn split(mut materials: Vec<Box<dyn Material>>, seed: u64) -> [Vec<Box<dyn Material>>; 2] {
    materials.shuffle(&mut random_stream(seed, u64::MAX));
    let held_out = materials.len() / 10;
    let validation = materials.split_off(materials.len() - held_out);
    [materials, validation]
}
