//! Tabulated principal components of materials.

use glimpse_core::model::linear::EPSILON;
use glimpse_materials::basis::{Basis, Grid, NODE_HEADER};
use nalgebra::{DMatrix, SymmetricEigen};
use rayon::prelude::*;

use super::Columns;

/// Returns the leading principal components of the selected columns about their mean, scaled by their singular values.
/// The number of components is at most the number of columns minus one.
#[must_use]
pub fn principal_components(columns: &Columns, selected: &[usize], components: usize) -> Basis {
    coefficients_of_columns(columns, selected, components).0
}

/// Returns the [principal components](principal_components), and the coefficients of the selected columns: a row for each
/// column. The mean square of a component's coefficients is 1 / (number of columns).
pub(super) fn coefficients_of_columns(
    columns: &Columns,
    selected: &[usize],
    components: usize,
) -> (Basis, Vec<f32>) {
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
        let largest = vector
            .iter()
            .fold(0.0_f64, |max, entry| match entry.abs() > max.abs() {
                true => *entry,
                false => max,
            });
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
                for (sum, entry) in sums.iter_mut().zip(vector) {
                    *sum += (value - mean) * entry;
                }
            }
            let median = median(&mut values);
            // The mean of the mapped columns, and ln(median w + e). The values are l - ln(e).
            head.copy_from_slice(&[mean - median, median + EPSILON.ln() as f32]);
        });
    (Basis::from_table(table, components), vectors)
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
