//! Interpolation between nodes, and its derivatives.

use std::f64::consts::{FRAC_PI_2, PI};

use glimpse_core::geometry::Angles;
use glimpse_core::model::linear::EPSILON;
use glimpse_materials::basis::{BasisValues, Grid};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{basis, rows};

/// Returns all values of a lookup, each with its derivatives.
fn flatten(values: BasisValues) -> Vec<[f64; 4]> {
    [vec![values.center], values.components].concat()
}

fn random_angles(random: &mut ChaCha8Rng) -> [f64; 3] {
    [FRAC_PI_2, FRAC_PI_2, PI].map(|range| range * random.random::<f64>())
}

#[test]
fn lookup_at_nodes_returns_the_table() {
    let basis = basis(5);
    for (node, row) in rows(&basis).iter().enumerate() {
        let values = flatten(basis.look_up(Grid::angles(node)));
        assert_eq!(values.len(), row.len() - 1);
        let center = row[0] + row[1] - EPSILON.ln();
        let expected = [&[center], &row[2..]].concat();
        for ([actual, ..], expected) in values.iter().zip(expected) {
            // The position of a node on the axes is rounded.
            let error = (actual - expected).abs() / expected.abs().max(1.0);
            assert!(error < 1e-12, "node {node}: {actual} instead of {expected}");
        }
    }
}

#[test]
fn derivatives_match_finite_differences() {
    const STEP: f64 = 1e-5;
    let basis = basis(5);
    let mut random = ChaCha8Rng::seed_from_u64(2);
    let mut crossed = 0;
    for _ in 0..3_000 {
        let angles = random_angles(&mut random);
        let cell = Grid::corners(Angles::from_array(angles))[0].0;
        let center = flatten(basis.look_up(Angles::from_array(angles)));
        for axis in 0..3 {
            // Nodes along theta_h are closer together towards 0, so the step of the difference decreases.
            let spacing = match axis {
                0 => (angles[0] / FRAC_PI_2).sqrt(),
                _ => 1.0,
            };
            let step = STEP * spacing;
            let at = |offset: f64| {
                let mut angles = angles;
                angles[axis] += offset;
                Angles::from_array(angles)
            };
            let points = [-2.0, -1.0, 1.0, 2.0].map(|offset| at(offset * step));
            // The interpolation is constant outside of the range of theta_h and theta_d.
            let range = 0.0..=FRAC_PI_2;
            let inside = |at: &Angles<f64>| {
                range.contains(&at.theta_h)
                    && range.contains(&at.theta_d)
                    && Grid::corners(*at)[0].0 == cell
            };
            if !points.iter().all(inside) {
                crossed += 1;
                continue;
            }
            let values = points.map(|at| flatten(basis.look_up(at)));
            for (index, entry) in center.iter().enumerate() {
                let [a, b, c, d] = values.each_ref().map(|list| list[index][0]);
                let difference = (a - 8.0 * b + 8.0 * c - d) / (12.0 * step);
                let slope = entry[1 + axis];
                let error = (slope - difference).abs() / slope.abs().max(1.0);
                assert!(
                    error < 1e-7,
                    "{slope} instead of {difference} at {angles:?}"
                );
            }
        }
    }
    // At most 5 % of the axes are skipped at cell faces.
    assert!(20 * crossed <= 3 * 3_000, "{crossed}");
}

#[test]
fn phi_d_has_period_pi_and_other_angles_are_clamped() {
    let basis = basis(5);
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let assert_near = |actual: [f64; 3], expected: [f64; 3]| {
        let [actual, expected] =
            [actual, expected].map(|at| flatten(basis.look_up(Angles::from_array(at))));
        for (actual, expected) in actual.iter().zip(&expected) {
            let error = (actual[0] - expected[0]).abs();
            assert!(
                error < 1e-8 * expected[0].abs().max(1.0),
                "{actual:?} instead of {expected:?}"
            );
        }
    };
    for _ in 0..1_000 {
        let [theta_h, theta_d, phi_d] = random_angles(&mut random);
        for periods in [-2.0, -1.0, 1.0, 2.0] {
            let shifted = [theta_h, theta_d, phi_d + periods * PI];
            assert_near(shifted, [theta_h, theta_d, phi_d]);
        }
        // The table is continuous at the boundary of the period.
        assert_near([theta_h, theta_d, PI - 1e-12], [theta_h, theta_d, 1e-12]);
    }
    // Outside of the range of theta_h and theta_d, the interpolation is constant.
    assert_near([2.0, -0.1, -1e-300], [FRAC_PI_2, 0.0, 0.0]);
}
