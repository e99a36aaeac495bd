//! Training of recipes without a pattern, for readings at any directions: a Gaussian prior of a material's coefficients.

use std::ops::ControlFlow;

use glimpse_core::fit::{Noise, Ridge};
use glimpse_core::numeric::{Floats, PackedRows};
use glimpse_core::recipe::Contents;
use glimpse_core::section::{MAX_PRECISION, MIN_PRECISION};
use glimpse_fitting::linear::{COMPACT_NODES, to_compact_bytes};
use glimpse_kernels::completion::Shape;
use glimpse_materials::Material;
use glimpse_materials::basis::BasisTable;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::dataset::{Dataset, Subset};
use super::objective::PriorObjective;
use super::train::phases;
use crate::job::Job;
use crate::linear::GaussianPrior;
use crate::outer::TrainingProgress;
use crate::result::{Learned, TrainError};
use crate::tasks::material::TaskMaterial;
use crate::tasks::task::{Dropout, TrainingTask};

/// The number of tasks. With other random ones, the loss on other materials changes by up to 10 %.
const TASKS: usize = 256;
/// The number of components, K. The loss is the same with 96, and 1 to 5 % larger with 24.
const COMPONENTS: usize = 40;
/// The variance of a mapped reading's noise.
const NOISE_VARIANCE: f64 = 0.02;

/// Trains a recipe without a pattern.
///
/// # Errors
/// If the materials are too few or all the same, the run is stopped, or a checkpoint cannot be read or written.
pub(crate) fn train_any<'a>(mut job: Job<'a, '_>) -> Result<Learned<'a>, TrainError> {
    let mut begin_phase = |phase| {
        let progress = TrainingProgress {
            phase,
            samples: 0,
            done: 0,
            total: 0,
            loss: f32::NAN,
            best: None,
        };
        match (job.session.observer)(&progress) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(TrainError::Stopped(0)),
        }
    };
    begin_phase("materials")?;
    let dataset = Dataset::of(job.materials, job.options);
    let mut random = ChaCha8Rng::seed_from_u64(job.options.seed);
    let plain = (0..dataset.training_count.min(TASKS / 2)).map(|index| {
        // Of more materials, every second or third one.
        let material = index * dataset.training_count / dataset.training_count.min(TASKS / 2);
        TrainingTask::plain(material, 0, 0)
    });
    let mut tasks: Vec<TrainingTask> = plain.collect();
    while tasks.len() < TASKS {
        tasks.push(dataset.draw_task(&dataset.groups, [0, 0], Dropout::Any, &mut random));
    }
    let tasks = tasks.into_iter().map(|task| {
        Box::new(TaskMaterial {
            materials: dataset.materials.clone(),
            task,
        }) as Box<dyn Material>
    });
    let tasks: Vec<_> = tasks.collect();
    begin_phase("components")?;
    let prior = GaussianPrior::new(&tasks, COMPONENTS).ok_or(TrainError::TooFewMaterials)?;
    let precision = |variances: &[f64], noise: f64| {
        let each = variances.iter().map(|variance| (noise / variance) as f32);
        each.map(|precision| precision.clamp(MIN_PRECISION, MAX_PRECISION))
            .collect()
    };
    // The mean of three channels has a third of the variance.
    let mean_precision: Vec<f32> = precision(&prior.mean_variance, NOISE_VARIANCE / 3.0);
    let difference_precision: Vec<f32> = precision(&prior.difference_variance, NOISE_VARIANCE);
    let compact = to_compact_bytes(&prior.basis, prior.basis.components(), COMPACT_NODES);
    let basis = BasisTable::parse(&compact).map_err(|_| TrainError::TooFewMaterials)?;
    let subset = Subset::new(&dataset, basis, &[]);
    let objective = PriorObjective::new(&subset, job.options);
    let objective = PriorObjective {
        shape: Shape {
            components: subset.basis.components(),
            hidden: 0,
            ..objective.shape
        },
        random_directions: Some([&mean_precision, &difference_precision]),
        ..objective
    };
    let refinement = if objective.refinement.is_some() {
        let phases = phases(&objective, job.options.effort);
        let values = job
            .session
            .run(objective.initial_values(0), &phases, None)?;
        objective.sections(job.arena, &values)
    } else {
        None
    };
    Ok(Learned {
        fit: Contents {
            ridge: Some(Ridge {
                precision: job.arena.floats(&mean_precision),
                difference_precision: job.arena.floats(&difference_precision),
                center: Floats::default(),
                rows: PackedRows::default(),
                basis_checksum: subset.basis.checksum(),
            }),
            noise: Some(Noise {
                variance: NOISE_VARIANCE as f32,
                scales: Floats::default(),
            }),
            start: refinement.map(|(start, _)| start),
            gauss_newton: refinement.map(|(_, steps)| steps),
            ..Contents::default()
        },
        basis: Some(compact),
        ..Learned::default()
    })
}
