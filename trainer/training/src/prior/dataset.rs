//! The training materials with their BRDF at many directions, and subsets for cross-validation.

use std::sync::{Arc, OnceLock};

use glimpse_fitting::recipe::options::TrainingOptions;
use glimpse_kernels::components::ComponentTable;
use glimpse_materials::basis::BasisTable;
use glimpse_materials::sampling::{sphere_view_samples, uniform_valid};
use glimpse_materials::{Material, Procedural};
use nalgebra::DMatrix;
use rand_chacha::ChaCha8Rng;

use super::refinement::VirtualReadings;
use crate::linear::{Columns, principal_components};
use crate::tasks::highlight_warp::HighlightWarp;
use crate::tasks::pool::WarpedPool;
use crate::tasks::task::{Dropout, MaterialGroup, ReadingOptions, TrainingTask};

/// The number of training directions that are uniform, as in the loss, for each one that is distributed like those of a
/// rendered sphere.
const UNIFORM_PER_SPHERE: usize = 3;

/// The maximum number of pool directions. With thousands of materials the pool is smaller; see [`pool_size`].
const MAX_POOL_SIZE: usize = 8_192;
/// The maximum memory of the pool in bytes, enough for 4,096 materials at all directions.
const MAX_POOL_BYTES: usize = 3 << 30;
/// The number of virtual readings.
const VIRTUAL_READINGS: usize = 96;

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
    /// The readings of tasks.
    pub reading_options: ReadingOptions,
    /// All materials at the directions of training tasks. The training materials have all highlight warps.
    pub pool: WarpedPool,
    /// All materials, without highlight warps, at the directions of validation. Training uses other directions.
    pub validation_pool: WarpedPool,
    columns: OnceLock<Columns>,
}

impl Dataset {
    /// Returns the dataset of `materials` and of procedural materials.
    pub(super) fn of(mut materials: Vec<Box<dyn Material>>, options: &TrainingOptions) -> Self {
        let training_count = materials.len();
        let sources = match &options.source_shares[..] {
            [] => vec![(training_count, 1.0)],
            source_shares => source_shares
                .iter()
                .map(|source| (source.materials, source.share))
                .collect(),
        };
        let mut groups = Vec::new();
        let mut classes = Vec::new();
        let mut first = 0;
        for (materials, share) in sources {
            groups.push(MaterialGroup {
                materials: (first..first + materials).collect(),
                share: share * (1.0 - options.procedural),
            });
            first += materials;
        }
        if options.procedural > 0.0 {
            let (count, seed) = TrainingOptions::PROCEDURAL_SET;
            let set = Procedural::set(count, seed);
            classes.extend(set.iter().map(Procedural::class_index));
            let set = set.into_iter();
            materials.extend(set.map(|each| Box::new(each) as Box<dyn Material>));
            groups.push(MaterialGroup {
                materials: (training_count..materials.len()).collect(),
                share: options.procedural,
            });
        }
        let reading_options = ReadingOptions {
            missing_share: options.missing(),
            noise: options.noise(),
        };
        let size = pool_size(training_count, HighlightWarp::all().len());
        let seed = options.seed;
        Self {
            classes,
            ..Self::new(
                materials,
                training_count,
                groups,
                reading_options,
                size,
                seed,
            )
        }
    }

    /// Evaluates materials at `size` directions for training, with all highlight warps, and at `size` other directions
    /// for validation. The first `training_count` materials are training materials. Groups may contain all materials.
    #[must_use]
    pub fn new(
        materials: Vec<Box<dyn Material>>,
        training_count: usize,
        groups: Vec<MaterialGroup>,
        reading_options: ReadingOptions,
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
            pool: WarpedPool::new(Arc::clone(&materials), training_count, directions.collect()),
            validation_pool: WarpedPool::new(Arc::clone(&materials), 0, uniform_valid(size, !seed)),
            materials,
            training_count,
            groups,
            classes: Vec::new(),
            reading_options,
        }
    }

    /// Draws a random task of some groups; see [`TrainingTask::random`].
    pub(super) fn draw_task(
        &self,
        groups: &[MaterialGroup],
        counts: [usize; 2],
        dropout: Dropout,
        random: &mut ChaCha8Rng,
    ) -> TrainingTask {
        let options = &self.reading_options;
        TrainingTask::random(&self.pool, groups, options, counts, dropout, random)
    }
}

/// Returns the number of directions of the training and the validation pool. It is halved until the values of both
/// pools, with all warps, fit into [`MAX_POOL_BYTES`].
fn pool_size(materials: usize, warps: usize) -> usize {
    const MIN_SIZE: usize = 512;
    let mut size = MAX_POOL_SIZE;
    while size > MIN_SIZE && materials * (warps + 1) * size * size_of::<[f32; 3]>() > MAX_POOL_BYTES
    {
        size /= 2;
    }
    size
}

/// The directions of a loss, and the components at them.
pub struct LossDirections<'d> {
    /// The materials at these directions.
    pub pool: &'d WarpedPool,
    /// The components at these directions.
    pub table: ComponentTable,
}

/// The part of a dataset used by one run: all of it, or all but one fold.
pub struct Subset<'d> {
    /// The dataset.
    pub dataset: &'d Dataset,
    /// The principal components of the training materials of this subset.
    pub basis: BasisTable,
    /// The directions of training.
    pub training: LossDirections<'d>,
    /// The directions of validation.
    pub validation: LossDirections<'d>,
    /// The components at the directions of virtual readings.
    pub virtual_readings: VirtualReadings,
    /// The groups that tasks are drawn from.
    pub groups: Vec<MaterialGroup>,
    /// The validation materials: those held out, or all training materials if none are held out.
    pub validation_materials: Vec<usize>,
}

impl<'d> Subset<'d> {
    /// Creates a subset with all materials except `held_out`, and with a number of principal components.
    #[must_use]
    pub fn without(dataset: &'d Dataset, components: usize, held_out: &[usize]) -> Self {
        let training = &dataset.materials[..dataset.training_count];
        let all_columns = dataset.columns.get_or_init(|| Columns::new(training));
        let columns = all_columns.columns_of(|index| !held_out.contains(&index));
        // Scaled to coefficients of about 1, which suit a small network.
        let scale = 1.0 / (columns.len() as f32).sqrt();
        let basis = principal_components(all_columns, &columns, components);
        let map = DMatrix::from_diagonal_element(basis.components(), basis.components(), scale);
        let basis = basis.mapped(map.as_slice());
        Self::new(dataset, basis, held_out)
    }

    /// Creates a subset with all materials except `held_out`, and with principal components.
    pub(super) fn new(dataset: &'d Dataset, basis: BasisTable, held_out: &[usize]) -> Self {
        let is_used = |index: &usize| !held_out.contains(index);
        let directions = |pool: &'d WarpedPool| LossDirections {
            pool,
            table: pool.components(&basis),
        };
        let groups = dataset.groups.iter().map(|group| MaterialGroup {
            materials: group.materials.iter().copied().filter(is_used).collect(),
            share: group.share,
        });
        Self {
            dataset,
            training: directions(&dataset.pool),
            validation: directions(&dataset.validation_pool),
            virtual_readings: VirtualReadings::new(&basis, VIRTUAL_READINGS),
            groups: groups.filter(|group| !group.materials.is_empty()).collect(),
            validation_materials: match held_out {
                [] => (0..dataset.training_count).collect(),
                held_out => held_out.to_vec(),
            },
            basis,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pool_shrinks_for_thousands_of_materials() {
        let sizes = [1, 100, 4_096, 4_097, 10_000, 1_000_000].map(|count| pool_size(count, 7));
        assert_eq!(sizes, [8_192, 8_192, 8_192, 4_096, 2_048, 512]);
    }
}
