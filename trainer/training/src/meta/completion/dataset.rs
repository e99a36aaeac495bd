//! The training materials with their BRDF at many directions, and subsets for cross-validation.

use std::sync::{Arc, OnceLock};

use glimpse_kernels::components::ComponentTable;
use glimpse_materials::Material;
use glimpse_materials::basis::Basis;
use glimpse_materials::sampling::{sphere_view_samples, uniform_valid};

use super::highlight_warp::HighlightWarp;
use super::pool::WarpedPool;
use super::task::{AugmentationOptions, MaterialGroup};
use super::virtual_readings::VirtualReadings;
use crate::linear::Columns;
use crate::linear::principal_components;

/// The number of training directions that are uniform, as in the loss, for each one that is distributed like those of a
/// rendered sphere.
const UNIFORM_PER_SPHERE: usize = 3;

/// The number of virtual readings.
pub(super) const VIRTUAL_READINGS: usize = 96;

/// The training materials with their BRDF at many directions.
pub struct Dataset {
    /// The training materials, followed by procedural ones, which are in tasks but not in the components.
    pub materials: Arc<[Box<dyn Material>]>,
    /// The number of training materials.
    pub training_count: usize,
    /// The groups that tasks are drawn from.
    pub groups: Vec<MaterialGroup>,
    /// The class of each additional material.
    pub classes: Vec<usize>,
    /// The augmentation of tasks.
    pub augmentation_options: AugmentationOptions,
    /// All materials at the directions of training tasks. The training materials have all highlight warps.
    pub pool: WarpedPool,
    /// All materials, without highlight warps, at the directions of validation. Training uses other directions.
    pub validation_pool: WarpedPool,
    columns: OnceLock<Columns>,
}

impl Dataset {
    /// Evaluates materials at `size` directions for training, with all highlight warps, and at `size` other directions
    /// for validation. The first `training_count` materials are training materials. Groups may contain all materials.
    #[must_use]
    pub fn new(
        materials: Vec<Box<dyn Material>>,
        training_count: usize,
        groups: Vec<MaterialGroup>,
        augmentation_options: AugmentationOptions,
        size: usize,
        seed: u64,
    ) -> Self {
        let materials: Arc<[Box<dyn Material>]> = materials.into();
        let spheres = size / (1 + UNIFORM_PER_SPHERE);
        let uniform = uniform_valid(spheres * UNIFORM_PER_SPHERE, seed);
        let uniform = uniform.chunks_exact(UNIFORM_PER_SPHERE);
        // They alternate, so that each block of directions has both.
        let directions = uniform.zip(sphere_view_samples(spheres, seed));
        let directions = directions.flat_map(|(uniform, sphere)| [uniform, &[sphere]].concat());
        Self {
            columns: OnceLock::new(),
            pool: WarpedPool::new(
                Arc::clone(&materials),
                training_count,
                &augmentation_options.warps,
                directions.collect(),
            ),
            validation_pool: WarpedPool::new(
                Arc::clone(&materials),
                0,
                &[HighlightWarp::IDENTITY],
                uniform_valid(size, !seed),
            ),
            materials,
            training_count,
            groups,
            classes: Vec::new(),
            augmentation_options,
        }
    }
}

/// The part of a dataset used by one run: all of it, or all but one fold.
pub struct Subset {
    /// The principal components of the training materials of this subset.
    pub basis: Basis,
    /// The components at the training directions.
    pub table: ComponentTable,
    /// The components at the validation directions.
    pub validation_table: ComponentTable,
    /// The components at the directions of virtual readings.
    pub virtual_readings: VirtualReadings,
    /// The groups that tasks are drawn from.
    pub groups: Vec<MaterialGroup>,
    /// The validation materials: those held out, or all training materials if none are held out.
    pub validation: Vec<usize>,
}

impl Subset {
    /// Creates a subset with all materials, and with a number of principal components.
    #[must_use]
    pub fn all(dataset: &Dataset, components: usize) -> Self {
        Self::without(dataset, components, &[])
    }

    /// Creates a subset with all materials except `held_out`.
    #[must_use]
    pub fn without(dataset: &Dataset, components: usize, held_out: &[usize]) -> Self {
        let is_used = |index: &usize| !held_out.contains(index);
        let all: Vec<usize> = (0..dataset.training_count).collect();
        let training = &dataset.materials[..dataset.training_count];
        let all_columns = dataset.columns.get_or_init(|| Columns::new(training));
        let columns = all_columns.columns_of(|index| is_used(&index));
        // Scaled to coefficients of about 1, which suit a small network.
        let scale = 1.0 / (columns.len() as f32).sqrt();
        let basis = principal_components(all_columns, &columns, components).scaled(scale);
        let groups = dataset.groups.iter().map(|group| MaterialGroup {
            materials: group.materials.iter().copied().filter(is_used).collect(),
            share: group.share,
        });
        Self {
            table: dataset.pool.components(&basis),
            validation_table: dataset.validation_pool.components(&basis),
            virtual_readings: VirtualReadings::new(&basis, VIRTUAL_READINGS),
            groups: groups.filter(|group| !group.materials.is_empty()).collect(),
            validation: match held_out {
                [] => all,
                held_out => held_out.to_vec(),
            },
            basis,
        }
    }
}
