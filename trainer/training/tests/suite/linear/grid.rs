//! Interpolation between nodes, and its slopes.

use std::f64::consts::{FRAC_PI_2, PI};

use glimpse_core::geometry::Angles;
use glimpse_materials::basis::{BasisValues, Grid};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{basis, rows};
use crate::support::angles_from_array;

/// All numbers of a look-up, each with its slopes.
fn all(found: BasisValues) -> Vec<[f64; 4]> {
    let mut list = vec![found.mean, found.log_median];
    list.extend(found.components);
    list
}

fn random_angles(random: &mut ChaCha8Rng) -> [f64; 3] {
    [FRAC_PI_2, FRAC_PI_2, PI].map(|range| range * random.random::<f64>())
}

#[test]
fn nodes_are_where_the_header_says() {
    let [h, d, p] = Grid::SHAPE.map(|nodes| nodes as usize);
    assert_eq!(Grid::LEN, h * d * p);
    let mut node = 0;
    for i in 0..h {
        for j in 0..d {
            for k in 0..p {
                let found = Grid::angles(node);
                let share = i as f64 / (h - 1) as f64;
                assert!((found.theta_h - FRAC_PI_2 * share * share).abs() < 1e-15);
                let theta_d = FRAC_PI_2 * j as f64 / (d - 1) as f64;
                assert!((found.theta_d - theta_d).abs() < 1e-15);
                assert!((found.phi_d - PI * k as f64 / p as f64).abs() < 1e-15);
                node += 1;
            }
        }
    }
}

#[test]
fn nodes_are_met_exactly() {
    let basis = basis(5);
    let mut largest = 0.0_f64;
    for (node, row) in rows(&basis).iter().enumerate() {
        let found = all(basis.look_up(Grid::angles(node)));
        assert_eq!(found.len(), row.len());
        for ([found, ..], expected) in found.iter().zip(row) {
            // A node's place on the axes is rounded.
            let error = (found - expected).abs() / expected.abs().max(1.0);
            assert!(error < 1e-12, "node {node}: {found} and not {expected}");
            largest = largest.max(error);
        }
    }
    println!("at nodes: largest error {largest:.1e}");
}

#[test]
fn weights_add_up_to_one_and_their_slopes_to_nothing() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let ends = [[0.0; 3], [FRAC_PI_2, FRAC_PI_2, PI], [2.0, -0.1, -1e-300]];
    let places = (0..10_000).map(|_| random_angles(&mut random)).chain(ends);
    for angles in places.collect::<Vec<_>>() {
        let corners = Grid::corners(angles_from_array(angles));
        let sum: f64 = corners.iter().map(|corner| corner.weight).sum();
        assert!((sum - 1.0).abs() < 1e-14, "{sum} at {angles:?}");
        assert!(corners.iter().all(|corner| corner.node < Grid::LEN));
        assert!(corners.iter().all(|corner| corner.weight >= -1e-14));
        for axis in 0..3 {
            let slopes = corners.map(|corner| corner.derivatives[axis]);
            let sum: f64 = slopes.iter().sum();
            let most = slopes.iter().fold(1.0_f64, |most, by| most.max(by.abs()));
            assert!(sum.abs() < 1e-13 * most, "{sum} at {angles:?}");
        }
    }
}

#[test]
fn slopes_agree_with_differences() {
    const STEP: f64 = 1e-5;
    let basis = basis(5);
    let mut random = ChaCha8Rng::seed_from_u64(2);
    let (mut compared, mut crossed, mut largest) = (0, 0, 0.0_f64);
    for _ in 0..3_000 {
        let angles = random_angles(&mut random);
        let cell = Grid::corners(angles_from_array(angles))[0].node;
        let middle = all(basis.look_up(angles_from_array(angles)));
        for axis in 0..3 {
            // Along theta_h nodes lie ever denser towards 0, and so do the points of a difference.
            let denser = match axis {
                0 => (angles[0] / FRAC_PI_2).sqrt(),
                _ => 1.0,
            };
            let step = STEP * denser;
            let at = |offset: f64| {
                let mut angles = angles;
                angles[axis] += offset;
                angles_from_array(angles)
            };
            let places = [-2.0, -1.0, 1.0, 2.0].map(|place| at(place * step));
            // Beyond the ends of the thetas it is constant.
            let ends = 0.0..=FRAC_PI_2;
            let inside = |at: &Angles<f64>| {
                ends.contains(&at.theta_h)
                    && ends.contains(&at.theta_d)
                    && Grid::corners(*at)[0].node == cell
            };
            if !places.iter().all(inside) {
                crossed += 1;
                continue;
            }
            let found = places.map(|at| all(basis.look_up(at)));
            for (index, entry) in middle.iter().enumerate() {
                let [a, b, c, d] = found.each_ref().map(|list| list[index][0]);
                let difference = (a - 8.0 * b + 8.0 * c - d) / (12.0 * step);
                let slope = entry[1 + axis];
                let error = (slope - difference).abs() / slope.abs().max(1.0);
                assert!(error < 1e-7, "{slope} and not {difference} at {angles:?}");
                largest = largest.max(error);
                compared += 1;
            }
        }
    }
    println!("{compared} slopes, {crossed} at faces, largest error {largest:.1e}");
    assert!(20 * crossed <= 3 * 3_000);
}

#[test]
fn phi_d_has_period_pi() {
    let basis = basis(5);
    let mut random = ChaCha8Rng::seed_from_u64(3);
    for _ in 0..1_000 {
        let [theta_h, theta_d, phi_d] = random_angles(&mut random);
        let expected = all(basis.look_up(angles_from_array([theta_h, theta_d, phi_d])));
        for turns in [-2.0, -1.0, 1.0, 2.0] {
            let found =
                all(basis.look_up(angles_from_array([theta_h, theta_d, phi_d + turns * PI])));
            for (found, expected) in found.as_flattened().iter().zip(expected.as_flattened()) {
                let error = (found - expected).abs();
                assert!(
                    error < 1e-9 * expected.abs().max(1.0),
                    "{found} and not {expected}"
                );
            }
        }
        // Across the seam there is no jump.
        let before = all(basis.look_up(angles_from_array([theta_h, theta_d, PI - 1e-12])));
        let after = all(basis.look_up(angles_from_array([theta_h, theta_d, 1e-12])));
        for (before, after) in before.iter().zip(&after) {
            assert!(
                (before[0] - after[0]).abs() < 1e-8,
                "{before:?} and {after:?}"
            );
        }
    }
}
