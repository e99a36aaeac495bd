//! Unit tests in f64: derivatives against finite differences, and mappings against integrals.

use std::f64::consts::{PI, TAU};

use glimpse_core::geometry::Angles;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::Tensors;
use super::distribution::{Densities, SlicePosition, TableShape};
use glimpse_kernels::Dual;

/// Returns tables of independent random values.
fn random_tensors(random: &mut ChaCha8Rng) -> Tensors {
    let shape = |columns, rows| TableShape { columns, rows };
    let mut values = |slices: usize, shape: TableShape| -> Vec<f32> {
        let indices = 0..slices * shape.nodes();
        indices.map(|_| random.random_range(0.2..1.0)).collect()
    };
    Tensors {
        theta_i: vec![0.1, 0.5, 1.2],
        ndf: (shape(7, 3), values(1, shape(7, 3))),
        sigma: (shape(5, 2), values(1, shape(5, 2))),
        vndf: Densities::new(shape(6, 8), values(3, shape(6, 8))),
        rgb: (shape(4, 5), values(9, shape(4, 5))),
    }
}

fn random_angles(random: &mut ChaCha8Rng) -> Angles<f64> {
    Angles {
        theta_h: random.random_range(0.02..1.5),
        theta_d: random.random_range(0.02..1.5),
        phi_d: random.random_range(0.0..TAU),
    }
}

#[test]
fn derivatives_match_finite_differences() {
    const STEP: f64 = 1e-6;
    let random = &mut ChaCha8Rng::seed_from_u64(1);
    let (mut compared, mut at_kinks, mut above_horizon) = (0, 0, 0);
    for _ in 0..20 {
        let tensors = random_tensors(random);
        for _ in 0..500 {
            let angles = random_angles(random);
            let (values, derivative) = Dual::split(tensors.brdf(Dual::variables(angles)));
            for (value, without_derivatives) in values.iter().zip(tensors.brdf(angles)) {
                assert!(
                    (value - without_derivatives).abs() <= 1e-14 * without_derivatives,
                    "{value} and {without_derivatives}"
                );
            }
            if values[0] == 0.0 {
                continue;
            }
            above_horizon += 1;
            for angle in 0..3 {
                let brdf_after_step = |step: f64| {
                    let mut moved = angles;
                    *[&mut moved.theta_h, &mut moved.theta_d, &mut moved.phi_d][angle] += step;
                    tensors.brdf(moved)
                };
                let (before, after) = (brdf_after_step(-STEP), brdf_after_step(STEP));
                for channel in 0..3 {
                    let left = (values[channel] - before[channel]) / STEP;
                    let right = (after[channel] - values[channel]) / STEP;
                    // Because of curvature, the one-sided differences differ in proportion to STEP. At a kink, they
                    // differ much more.
                    let scale = values[channel] + left.abs() + right.abs();
                    let curvature = scale * scale / values[channel];
                    if (right - left).abs() > 1e-3 * curvature {
                        at_kinks += 1;
                        continue;
                    }
                    compared += 1;
                    let error = (0.5 * (left + right) - derivative[channel][angle]).abs();
                    assert!(
                        error < 1e-6 * curvature,
                        "{error} of {scale} along angle {angle} at {angles:?}"
                    );
                }
            }
        }
    }
    assert!(
        above_horizon > 5_000,
        "{above_horizon} directions above the horizon"
    );
    assert!(
        at_kinks * 200 < compared,
        "{at_kinks} kinks, {compared} compared"
    );
}

/// At the poles, derivatives may not exist.
#[test]
fn derivatives_are_finite_at_the_poles() {
    let tensors = random_tensors(&mut ChaCha8Rng::seed_from_u64(2));
    for theta_h in [0.0, -0.0, 1e-20, 0.3] {
        for theta_d in [0.0, 1e-20, 0.3] {
            for phi_d in [0.0, PI, TAU, -1.0] {
                let angles = Angles {
                    theta_h,
                    theta_d,
                    phi_d,
                };
                let (values, derivative) = Dual::split(tensors.brdf(Dual::variables(angles)));
                assert!(values.iter().all(|value| *value > 0.0), "{angles:?}");
                let finite = derivative
                    .as_flattened()
                    .iter()
                    .all(|slope| slope.is_finite());
                assert!(finite, "{derivative:?} at {angles:?}");
            }
        }
    }
}

#[test]
fn jacobian_of_the_mapping_is_the_density() {
    // One slice, so that the Jacobian of the mapping is the normalized density.
    let shape = TableShape {
        columns: 5,
        rows: 4,
    };
    let random = &mut ChaCha8Rng::seed_from_u64(3);
    let values: Vec<f32> = (0..shape.nodes())
        .map(|_| random.random_range(0.1..1.0))
        .collect();
    let densities = Densities::new(shape, values.clone());
    let position = SlicePosition::new(0.7, &[0.0]);
    for corner in [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
        let image = densities.map_to_uniform(corner, &position);
        for (image, corner) in image.iter().zip(corner) {
            assert!((image - corner).abs() < 1e-6, "{image} and {corner}");
        }
    }
    for _ in 0..1000 {
        let [x, y] = [0; 2].map(|_| random.random_range(0.001..0.999));
        // The Jacobian by finite differences.
        let step = 1e-5;
        let image = |x, y| densities.map_to_uniform([x, y], &position);
        let slope_x = image(x + step, y)[0] - image(x - step, y)[0];
        let slope_y = image(x, y + step)[1] - image(x, y - step)[1];
        let jacobian = slope_x * slope_y / (4.0 * step * step);
        // The density, by the definition of a bilinear function.
        let [i, j] = [(x * 4.0) as usize, (y * 3.0) as usize];
        let [s, t] = [x * 4.0 - i as f64, y * 3.0 - j as f64];
        let node_value = |i: usize, j: usize| f64::from(values[i + 5 * j]);
        let row = |j| node_value(i, j) * (1.0 - s) + node_value(i + 1, j) * s;
        let expected = row(j) * (1.0 - t) + row(j + 1) * t;
        let weight = |k: usize, last: usize| if k == 0 || k == last { 0.5 } else { 1.0 };
        let mut total = 0.0;
        for j in 0..4 {
            for i in 0..5 {
                total += node_value(i, j) * weight(i, 4) * weight(j, 3) / 12.0;
            }
        }
        let node_distances = [s * 0.25, (1.0 - s) * 0.25, t / 3.0, (1.0 - t) / 3.0];
        if node_distances.iter().all(|distance| *distance > step) {
            assert!(
                (jacobian - expected / total).abs() < 1e-3 * jacobian,
                "{jacobian} and {} at {x}, {y}",
                expected / total
            );
        }
    }
}

#[test]
fn zero_density_maps_to_a_finite_point() {
    let shape = TableShape {
        columns: 3,
        rows: 3,
    };
    let densities = Densities::new(shape, vec![0.0; 9]);
    let point = densities.map_to_uniform([0.4, 0.6], &SlicePosition::new(0.0, &[0.0]));
    assert_eq!(point, [0.0, 0.0]);
}
