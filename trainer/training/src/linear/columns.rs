//! Materials as columns of l = ln(brdf w + e) at the nodes of the grid, one column per channel, and their principal
//! components.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear::{EPSILON, map};
use glimpse_materials::Material;
use glimpse_materials::basis::{BasisTable, Grid, NODE_HEADER};
use glimpse_materials::half_differences;
use glimpse_materials::lists::add_scaled;
use nalgebra::{DMatrix, SymmetricEigen};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Columns of materials, three per material (red, green, blue), stored node by node.
pub struct Columns {
    /// l of all columns at each node: `Grid::LEN` rows of `count`.
    values: Vec<f32>,
    count: usize,
    /// The indices of the tabulated materials, in order.
    materials: Vec<usize>,
    /// x'y of each pair of columns over the valid nodes, row by row. The mean of all columns is subtracted at each
    /// node.
    products: Vec<f64>,
}

/// The largest number of tabulated materials. A column takes half a megabyte, and the time for principal components
/// grows with the third power of the number of columns. The leading components hardly change with more materials.
pub const MAX_TABULATED: usize = 512;

/// The number of nodes per parallel work item.
const BLOCK: usize = 512;

impl Columns {
    /// Tabulates materials. Of more than [`MAX_TABULATED`] materials, a random selection with a fixed seed is
    /// tabulated.
    ///
    /// By reciprocity, the grid has period pi in phi_d. A material that is not reciprocal is averaged over phi_d and
    /// phi_d + pi.
    #[must_use]
    pub fn new(materials: &[Box<dyn Material>]) -> Self {
        let selected = select(materials.len());
        let count = 3 * selected.len();
        let angles: Vec<Angles<f64>> = (0..Grid::LEN).map(Grid::angles).collect();
        let at = |turn: f64| {
            let turned = angles.iter().map(|angles| Angles {
                phi_d: angles.phi_d + turn,
                ..*angles
            });
            half_differences(turned.map(|angles| angles.map(|angle| angle as f32)))
        };
        let (one, opposite) = (at(0.0), at(std::f64::consts::PI));
        let weights = angles.iter().map(|angles| {
            let at = HalfDifference::from_angles(*angles);
            at.cos_theta_i().max(0.0) * at.cos_theta_o().max(0.0)
        });
        let weights: Vec<f64> = weights.collect();
        let mut values = vec![0.0; Grid::LEN * count];
        values
            .par_chunks_mut(BLOCK * count)
            .zip(one.par_chunks(BLOCK))
            .zip(opposite.par_chunks(BLOCK))
            .zip(weights.par_chunks(BLOCK))
            .for_each(|(((rows, one), opposite), weights)| {
                for (index, material) in selected.iter().enumerate() {
                    let material = &materials[*material];
                    let brdf = material.values_at(one);
                    let others = if material.is_reciprocal() {
                        brdf.clone()
                    } else {
                        material.values_at(opposite)
                    };
                    let measured = brdf.iter().zip(others).zip(weights);
                    for (row, ((one, other), weight)) in rows.chunks_mut(count).zip(measured) {
                        for channel in 0..3 {
                            let mean = 0.5 * (f64::from(one[channel]) + f64::from(other[channel]));
                            // ln((brdf w + e) / e), without a median. It is far enough from 0 for single precision.
                            row[3 * index + channel] = map(mean, *weight) as f32;
                        }
                    }
                }
            });
        let products = products(&values, count);
        Self {
            values,
            count,
            materials: selected,
            products,
        }
    }

    /// Returns the number of columns.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// Returns the indices of the columns of materials that meet a condition. The condition receives the material's
    /// index in the list passed to [`Columns::new`].
    pub fn columns_of(&self, condition: impl Fn(usize) -> bool) -> Vec<usize> {
        let materials = self.materials.iter().enumerate();
        materials
            .filter(|(_, material)| condition(**material))
            .flat_map(|(position, _)| 3 * position..3 * position + 3)
            .collect()
    }

    /// Returns the values l - ln(e) of all columns at a node.
    #[must_use]
    pub fn at_node(&self, node: usize) -> &[f32] {
        &self.values[node * self.count..][..self.count]
    }

    /// Returns the sum over the valid nodes of the product of two columns. The mean of all columns is subtracted from
    /// both: that does not change centered products, and reduces rounding errors.
    #[must_use]
    pub fn product(&self, one: usize, other: usize) -> f64 {
        self.products[one * self.count + other]
    }
}

/// Returns the sorted indices of the materials to tabulate. `materials` is the number of all materials.
fn select(materials: usize) -> Vec<usize> {
    if materials <= MAX_TABULATED {
        return (0..materials).collect();
    }
    // A regular stride could skip whole folds or sources; a random selection does not.
    let mut random = ChaCha8Rng::seed_from_u64(0);
    let mut selected: Vec<usize> = (0..materials).collect();
    selected.shuffle(&mut random);
    selected.truncate(MAX_TABULATED);
    selected.sort_unstable();
    selected
}

fn products(values: &[f32], count: usize) -> Vec<f64> {
    let valid: Vec<(&[f32], f32)> = values
        .par_chunks(count)
        .enumerate()
        .filter(|(node, _)| Grid::is_valid(*node))
        .map(|(_, row)| (row, row.iter().sum::<f32>() / count as f32))
        .collect();
    // Each thread computes whole rows of the product, so the order of each sum is fixed.
    const ROWS: usize = 8;
    let mut products = vec![0.0; count * count];
    products
        .par_chunks_mut(ROWS * count)
        .enumerate()
        .for_each(|(block, sums)| {
            let mut shifted = Vec::new();
            for nodes in valid.chunks(64) {
                shifted.clear();
                for (row, mean) in nodes {
                    shifted.extend(row.iter().map(|value| value - mean));
                }
                for (row, sums) in sums.chunks_mut(count).enumerate() {
                    let mut partial = vec![0.0_f32; count];
                    for node in shifted.chunks(count) {
                        let factor = node[block * ROWS + row];
                        add_scaled(&mut partial, factor, node);
                    }
                    add_scaled(sums, 1.0, &partial);
                }
            }
        });
    products
}

/// Returns the leading principal components of the selected columns about their mean, scaled by their singular values.
/// The number of components is at most the number of columns minus one.
#[must_use]
pub fn principal_components(
    columns: &Columns,
    selected: &[usize],
    components: usize,
) -> BasisTable {
    coefficients_of_columns(columns, selected, components).0
}

/// Returns the [principal components](principal_components), and the coefficients of the selected columns: a row for each
/// column. The mean square of a component's coefficients is 1 / (number of columns).
pub(super) fn coefficients_of_columns(
    columns: &Columns,
    selected: &[usize],
    components: usize,
) -> (BasisTable, Vec<f32>) {
    let count = selected.len();
    let components = components.min(count.saturating_sub(1)).max(1);
    // The products of the centered columns follow from the products of the uncentered columns.
    let raw = DMatrix::from_fn(count, count, |i, j| {
        columns.product(selected[i], selected[j])
    });
    let row_means: Vec<f64> = (0..count).map(|i| raw.row(i).mean()).collect();
    let mean = raw.mean();
    let centered = DMatrix::from_fn(count, count, |i, j| {
        raw[(i, j)] - row_means[i] - row_means[j] + mean
    });
    let eigen = SymmetricEigen::new(centered);
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    // X v = s u, where X has the centered columns, v is an eigenvector, s a singular value, and u a component. The sign
    // of v is arbitrary: make its largest entry positive.
    let mut vectors = vec![0.0_f32; count * components];
    for (k, index) in order.into_iter().take(components).enumerate() {
        let vector = eigen.eigenvectors.column(index);
        let largest = vector[vector.iamax()];
        for (column, entry) in vector.iter().enumerate() {
            vectors[column * components + k] = (entry * largest.signum()) as f32;
        }
    }
    let row_length = NODE_HEADER + components;
    let mut table = vec![0.0_f32; Grid::LEN * row_length];
    table
        .par_chunks_mut(row_length)
        .enumerate()
        .for_each(|(node, entries)| {
            let node_values = columns.at_node(node);
            let mut values: Vec<f32> = selected.iter().map(|index| node_values[*index]).collect();
            let sum: f64 = values.iter().copied().map(f64::from).sum();
            let mean = (sum / count as f64) as f32;
            let (head, sums) = entries.split_at_mut(NODE_HEADER);
            for (value, vector) in values.iter().zip(vectors.chunks(components)) {
                add_scaled(sums, value - mean, vector);
            }
            let median = median(&mut values);
            // The mean of the mapped columns, and ln(median w + e). The values are l - ln(e).
            head.copy_from_slice(&[mean - median, median + EPSILON.ln() as f32]);
        });
    (BasisTable::from_table(table, components), vectors)
}

/// Returns the median of the values, and reorders them.
fn median(values: &mut [f32]) -> f32 {
    let (below, upper, _) = values.select_nth_unstable_by(values.len() / 2, f32::total_cmp);
    let upper = *upper;
    match below.iter().copied().max_by(f32::total_cmp) {
        Some(lower) if values.len().is_multiple_of(2) => 0.5 * (lower + upper),
        _ => upper,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_set_is_subsampled_evenly_across_folds() {
        assert!(select(MAX_TABULATED).into_iter().eq(0..MAX_TABULATED));
        let selected = select(3_000);
        assert_eq!((selected.len(), &selected), (MAX_TABULATED, &select(3_000)));
        assert!(selected.is_sorted_by(|a, b| a < b) && selected[MAX_TABULATED - 1] < 3_000);
        for fold in 0..5 {
            let share = selected.iter().filter(|index| *index % 5 == fold).count();
            assert!((60..150).contains(&share), "{share} of fold {fold}");
        }
    }
}
