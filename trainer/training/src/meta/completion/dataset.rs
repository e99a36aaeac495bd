//! Materials to train on, and what is known of them before training.

use std::sync::Arc;

use glimpse_kernels::components::ComponentTable;
use glimpse_materials::Material;
use glimpse_materials::basis::Basis;
use glimpse_materials::sampling::{seen_on_spheres, uniform_valid};

use super::draw::{AugmentationOptions, Group};
use super::highlight_warp::HighlightWarp;
use super::pool::WarpedPool;
use crate::linear::Columns;
use crate::linear::principal_components;

/// The share of directions that tasks are judged at as pictures see them; the others are uniform, as the
/// loss has them.
const SEEN: f32 = 0.25;

/// Materials to train on, with their BRDF at many directions.
pub struct Dataset {
    /// The materials that are learned from, and then those that are only mixed in.
    pub materials: Arc<[Box<dyn Material>]>,
    /// How many of them are learned from.
    pub own: usize,
    /// Which of them tasks are of.
    pub groups: Vec<Group>,
    /// How tasks are varied.
    pub variety: AugmentationOptions,
    /// Where tasks are judged in training; the materials of its own are there with every highlight warp.
    pub pool: WarpedPool,
    /// Where materials are judged as they are, at directions that training does not see.
    pub fresh: WarpedPool,
    columns: Columns,
}

impl Dataset {
    /// Materials at `size` directions, with each highlight warp, and at as many fresh ones. The first `own` are
    /// learned from; the others are mixed in, as groups say.
    #[must_use]
    pub fn new(
        materials: Vec<Box<dyn Material>>,
        own: usize,
        groups: Vec<Group>,
        variety: AugmentationOptions,
        size: usize,
        seed: u64,
    ) -> Self {
        let materials: Arc<[Box<dyn Material>]> = materials.into();
        let few = (SEEN * size as f32) as usize;
        let places = [uniform_valid(size - few, seed), seen_on_spheres(few, seed)];
        Self {
            columns: Columns::new(&materials[..own]),
            pool: WarpedPool::new(Arc::clone(&materials), own, &variety.warps, places.concat()),
            fresh: WarpedPool::new(
                Arc::clone(&materials),
                0,
                &[HighlightWarp::NONE],
                uniform_valid(size, !seed),
            ),
            materials,
            own,
            groups,
            variety,
        }
    }
}

/// What a training run sees of a dataset: all of it, or all but some materials.
pub struct Part {
    /// Principal components of the materials that it sees.
    pub basis: Basis,
    /// The components where tasks are judged in training.
    pub table: ComponentTable,
    /// The components at the fresh directions.
    pub fresh: ComponentTable,
    /// Which materials tasks are of.
    pub groups: Vec<Group>,
    /// Which materials it is judged on: those left out, or all that are learned from.
    pub judged: Vec<usize>,
}

impl Part {
    /// All of a dataset, with so many principal components.
    #[must_use]
    pub fn whole(dataset: &Dataset, components: usize) -> Self {
        Self::without(dataset, components, &[])
    }

    /// All but the materials that are left out.
    #[must_use]
    pub fn without(dataset: &Dataset, components: usize, left_out: &[usize]) -> Self {
        let seen = |index: &usize| !left_out.contains(index);
        let own: Vec<usize> = (0..dataset.own).collect();
        let chosen = dataset.columns.of(|index| seen(&index));
        // Coefficients of about 1, as a small map is best at.
        let scale = 1.0 / (chosen.len() as f32).sqrt();
        let basis = principal_components(&dataset.columns, &chosen, components).scaled(scale);
        let groups = dataset.groups.iter().map(|group| Group {
            materials: group.materials.iter().copied().filter(seen).collect(),
            share: group.share,
        });
        Self {
            table: dataset.pool.components(&basis),
            fresh: dataset.fresh.components(&basis),
            groups: groups.filter(|group| !group.materials.is_empty()).collect(),
            judged: match left_out {
                [] => own,
                some => some.to_vec(),
            },
            basis,
        }
    }
}
