//! The values of the tables: mean, median and principal components of the columns.

use std::f64::consts::PI;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear::EPSILON;
use glimpse_materials::Brdf;
use glimpse_materials::basis::Grid;
use nalgebra::{DMatrix, DVector};

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
fn components_are_orthogonal_and_singular_values_are_their_lengths() {
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
    let valid: Vec<usize> = (0..Grid::LEN)
        .filter(|node| Grid::is_valid(*node))
        .collect();
    let components = components.select_rows(&valid);
    let products = components.tr_mul(&components);
    let (mut max_cosine, mut max_error) = (0.0_f64, 0.0_f64);
    for i in 0..components.ncols() {
        let length = products[(i, i)].sqrt();
        max_error = max_error.max((length - expected[i]).abs() / expected[i]);
        for j in 0..i {
            let cosine = products[(i, j)] / (length * products[(j, j)].sqrt());
            max_cosine = max_cosine.max(cosine.abs());
        }
    }
    println!(
        "singular values {:.1} to {:.1}: largest error of lengths {max_error:.1e}, largest cosine {max_cosine:.1e}",
        expected[0],
        expected[components.ncols() - 1]
    );
    assert!(max_error < 1e-4, "{max_error}");
    assert!(max_cosine < 1e-4, "{max_cosine}");
}

#[test]
fn all_components_reproduce_columns() {
    let count = MATERIALS.columns.count();
    // At most the number of columns minus one, because the mean is subtracted.
    let basis = basis(usize::MAX);
    assert_eq!(basis.components(), count - 1);
    let rows = rows(&basis);
    let components = components(&rows);
    let centered = centered();
    // Least squares with components scaled to length 1.
    let scales = DVector::from_iterator(
        count - 1,
        components.column_iter().map(|column| 1.0 / column.norm()),
    );
    let unit = &components * DMatrix::from_diagonal(&scales);
    let normal = unit
        .tr_mul(&unit)
        .cholesky()
        .expect("the components are independent");
    let coefficients = DMatrix::from_diagonal(&scales) * normal.solve(&unit.tr_mul(&centered));

    for (index, material) in MATERIALS.materials.iter().enumerate() {
        let coefficients = [0, 1, 2].map(|channel| {
            coefficients
                .column(3 * index + channel)
                .iter()
                .copied()
                .collect()
        });
        let reconstruction = basis.reconstruct(&coefficients);
        for node in (0..Grid::LEN).step_by(11) {
            let angles = Grid::angles(node);
            let at = HalfDifference::from_angles(angles);
            let weight = at.cos_theta_i() * at.cos_theta_o();
            if at.cos_theta_i().min(at.cos_theta_o()) < 0.05 || !Grid::is_valid(node) {
                continue;
            }
            let at = [0.0, PI].map(|offset| half_difference(angles, offset));
            let both = material.values_at(&at);
            let brdf = reconstruction.values_at(&at[..1]);
            for channel in 0..3 {
                let expected = 0.5 * f64::from(both[0][channel] + both[1][channel]);
                let actual = f64::from(brdf[0][channel]);
                // The mapping is ln(1 + f w / e), so the error is relative to f + e / w.
                let error = (actual - expected).abs() / (expected + EPSILON / weight);
                assert!(
                    error < 1e-3,
                    "material {index}, node {node}: {actual} instead of {expected}"
                );
            }
        }
    }
}
