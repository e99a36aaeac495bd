//! Tests of the tables of the model Linear (grid, columns, principal components, files), and of the patterns of the
//! method NJR15 (Nielsen et al. 2015). `meta_gradient` tests the training.

mod basis;
mod compact;
mod condition;
mod grid;

use std::sync::LazyLock;

use glimpse_materials::basis::{BasisTable, Grid};
use glimpse_materials::{Material, Procedural};
use glimpse_training::linear::{Columns, principal_components};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::support::network;

/// Networks (even indices) and procedural materials (odd indices), with their columns.
pub(crate) struct TestMaterials {
    pub(crate) materials: Vec<Box<dyn Material>>,
    pub(crate) columns: Columns,
}

pub(crate) static MATERIALS: LazyLock<TestMaterials> = LazyLock::new(|| {
    let mut random = ChaCha8Rng::seed_from_u64(9);
    let mut materials: Vec<Box<dyn Material>> = Vec::new();
    for index in 0..3 {
        materials.push(Box::new(network(&mut random)));
        materials.push(Box::new(Procedural::new(index, 4)));
    }
    TestMaterials {
        columns: Columns::new(&materials),
        materials,
    }
});

/// Computes a basis of all columns with the given number of components.
pub(crate) fn basis(components: usize) -> BasisTable {
    let all: Vec<usize> = (0..MATERIALS.columns.count()).collect();
    principal_components(&MATERIALS.columns, &all, components)
}

/// Returns the table of a basis. The row of a node holds the mean minus the median of the columns, the median plus ln e,
/// and the components.
pub(crate) fn rows(basis: &BasisTable) -> Vec<Vec<f64>> {
    let row = |node| basis.row(node).iter().copied().map(f64::from).collect();
    (0..Grid::LEN).map(row).collect()
}
