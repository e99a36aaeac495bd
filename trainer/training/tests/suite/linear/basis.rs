//! The values of the tables: mean, median and principal components of the columns.

use std::f64::consts::PI;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear::EPSILON;
use glimpse_materials::basis::Grid;
use nalgebra::DMatrix;

use super::{MATERIALS, basis, rows};

/// Returns the values of the columns at all nodes, minus their mean.
fn centered() -> DMatrix<f64> {
    let count = MATERIALS.columns.count();
    let mut matrix = DMatrix::from_fn(Grid::LEN, count, |node, column| {
        f64::from(MATERIALS.columns.at_node(node)[column])
    });
    for mut row in matrix.row_iter_mut() {
        let mean = row.mean();
        row.add_scalar_mut(-mean);
    }
    matrix
}

/// Returns the components of a basis, one per matrix column.
fn components(rows: &[Vec<f64>]) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), rows[0].len() - 2, |node, k| rows[node][2 + k])
}

fn half_difference(angles: Angles<f64>, phi_d_offset: f64) -> HalfDifference<f32> {
    let phi_d = angles.phi_d + phi_d_offset;
    HalfDifference::from_angles(Angles { phi_d, ..angles }.map(|angle| angle as f32))
}

#[test]
fn columns_are_logarithms_of_materials() {
    for node in (0..Grid::LEN).step_by(37) {
        let angles = Grid::angles(node);
        let at = HalfDifference::from_angles(angles);
        let weight = at.cos_theta_i().max(0.0) * at.cos_theta_o().max(0.0);
        let at = [0.0, PI].map(|offset| half_difference(angles, offset));
        let materials = MATERIALS.materials.iter();
        let brdf: Vec<_> = materials.map(|material| material.values_at(&at)).collect();
        for (column, value) in MATERIALS.columns.at_node(node).iter().enumerate() {
            // Columns hold the mean over phi_d and phi_d + pi.
            let [a, b] = [0, 1].map(|half| f64::from(brdf[column / 3][half][column % 3]));
            let expected = (0.5 * (a + b) * weight / EPSILON).ln_1p();
            let error = (f64::from(*value) - expected).abs();
            // Materials are evaluated in single precision, on lanes or as scalars.
            assert!(
                error < 1e-4,
                "node {node}, column {column}: {value} instead of {expected}"
            );
        }
    }
}

#[test]
fn tables_have_mean_and_median_of_columns() {
    for (node, row) in rows(&basis(5)).iter().enumerate() {
        let mut values: Vec<f64> = MATERIALS
            .columns
            .at_node(node)
            .iter()
            .copied()
            .map(f64::from)
            .collect();
        let count = values.len();
        let mean = values.iter().sum::<f64>() / count as f64;
        values.sort_by(f64::total_cmp);
        let median = 0.5 * (values[count / 2 - 1] + values[count / 2]);
        assert!((row[0] - (mean - median)).abs() < 2e-6, "node {node}");
        assert!(
            (row[1] - (median + EPSILON.ln())).abs() < 2e-6,
            "node {node}"
        );
    }
}

#[test]
fn components_are_the_first_singular_vectors_times_their_values() {
    let centered = centered();
    // Computed in double precision and by a different method than in training.
    let gram = centered.tr_mul(&centered);
    let mut expected: Vec<f64> = gram
        .symmetric_eigenvalues()
        .iter()
        .map(|square| square.max(0.0).sqrt())
        .collect();
    expected.sort_by(|a, b| b.total_cmp(a));

    let components = components(&rows(&basis(10)));
    // Orthogonal vectors of these lengths are the singular vectors if none of the variance along them is missing.
    let along = centered.tr_mul(&components);
    let valid: Vec<usize> = (0..Grid::LEN)
        .filter(|node| Grid::is_valid(*node))
        .collect();
    let components = components.select_rows(&valid);
    let products = components.tr_mul(&components);
    let (mut max_cosine, mut max_error) = (0.0_f64, 0.0_f64);
    for i in 0..components.ncols() {
        let length = products[(i, i)].sqrt();
        for length in [length, along.column(i).norm() / length] {
            max_error = max_error.max((length - expected[i]).abs() / expected[i]);
        }
        for j in 0..i {
            let cosine = products[(i, j)] / (length * products[(j, j)].sqrt());
            max_cosine = max_cosine.max(cosine.abs());
        }
    }
    assert!(max_error < 1e-4, "{max_error}");
    assert!(max_cosine < 1e-4, "{max_cosine}");
    // At most the number of columns minus one, because the mean is subtracted.
    let count = MATERIALS.columns.count();
    assert_eq!(basis(usize::MAX).components(), count - 1);
}
