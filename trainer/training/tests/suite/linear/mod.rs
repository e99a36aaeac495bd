//! The tables of the model Linear: grid, columns, principal components, files, and the patterns of the method NJR15.
//! (`meta_gradient` and `burn_reference` test the training.)

mod basis;
mod compact;
mod condition;
mod file;
mod grid;

use std::sync::LazyLock;

use glimpse_materials::basis::Basis;
use glimpse_materials::{Material, Procedural};
use glimpse_training::linear::{Columns, principal_components};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::support::network;

/// Networks and procedural materials, with their columns.
pub(crate) struct Set {
    pub(crate) materials: Vec<Box<dyn Material>>,
    pub(crate) columns: Columns,
}

pub(crate) static SET: LazyLock<Set> = LazyLock::new(|| {
    let mut random = ChaCha8Rng::seed_from_u64(9);
    let mut materials: Vec<Box<dyn Material>> = Vec::new();
    for index in 0..3 {
        materials.push(Box::new(network(&mut random)));
        materials.push(Box::new(Procedural::new(index, 4)));
    }
    Set {
        columns: Columns::new(&materials),
        materials,
    }
});

/// Returns the basis of all columns with a number of components.
pub(crate) fn basis(components: usize) -> Basis {
    let all: Vec<usize> = (0..SET.columns.count()).collect();
    principal_components(&SET.columns, &all, components)
}

/// Reads a basis's table from the bytes of its file: mean, ln(median w + e) and components of each node.
pub(crate) fn rows(basis: &Basis) -> Vec<Vec<f64>> {
    let bytes = basis.to_bytes();
    let words = bytes[24..].as_chunks::<4>().0.iter();
    let numbers: Vec<f64> = words
        .map(|word| f64::from(f32::from_le_bytes(*word)))
        .collect();
    let rows = numbers.chunks(2 + basis.components());
    rows.map(<[f64]>::to_vec).collect()
}
