//! Unit tests in f64: derivatives, and densities that are 0.

use std::f64::consts::{PI, TAU};

use glimpse_core::geometry::Angles;
use glimpse_core::numeric::{Scalar, Trigonometry};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::Tensors;
use super::distribution::{Densities, TableShape};
use crate::interpolation::Position;
use glimpse_kernels::Dual;
use glimpse_kernels::dual::RealScalar;

/// Returns tables of independent random values.
fn random_tensors(random: &mut ChaCha8Rng) -> Tensors {
    let shape = |columns, rows| TableShape { columns, rows };
    let mut values = |slices: usize, shape: TableShape| -> Vec<f32> {
        let indices = 0..slices * shape.nodes();
        indices.map(|_| random.random_range(0.2..1.0)).collect()
    };
    Tensors {
        omission: None,
        theta_i: vec![0.1, 0.5, 1.2],
        ndf: (shape(7, 3), values(1, shape(7, 3))),
        sigma: (shape(5, 2), values(1, shape(5, 2))),
        vndf: Densities::new(shape(6, 8), values(3, shape(6, 8))),
        rgb: (shape(4, 5), values(9, shape(4, 5))),
    }
}

/// The functions whose derivatives are not those of [`glimpse_core::numeric`].
#[test]
fn derivatives_of_root_and_arctangent() {
    for at in [-3.0, -1.2, 0.1, 0.8, 2.5] {
        let angle = Dual::<f64, 1> {
            value: at,
            tangent: [1.0],
        };
        let (sin, cos) = angle.sin_cos();
        let radius = Dual::constant(2.0) + angle * angle;
        let same = (radius * sin).atan2(radius * cos);
        assert!((same.value - at).abs() < 1e-14 && (same.tangent[0] - 1.0).abs() < 1e-14);
        let root = (angle * angle).sqrt();
        assert!(
            (root.value - at.abs()).abs() < 1e-14 && (root.tangent[0] - at.signum()).abs() < 1e-14
        );
    }
}

/// At the poles, derivatives may not exist.
#[test]
fn derivatives_are_finite_at_the_poles() {
    let tensors = random_tensors(&mut ChaCha8Rng::seed_from_u64(2));
    for theta_h in [0.0, -0.0, 1e-20, 0.3] {
        for theta_d in [0.0, 1e-20, 0.3] {
            for phi_d in [0.0, PI, TAU, -1.0] {
                let angles = Angles::from_array([theta_h, theta_d, phi_d]);
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
fn zero_density_maps_to_a_finite_point() {
    let shape = TableShape {
        columns: 3,
        rows: 3,
    };
    let densities = Densities::new(shape, vec![0.0; 9]);
    let point = densities.map_to_uniform([0.4, 0.6], &Position::new(0.0, &[0.0]));
    assert_eq!(point, [0.0, 0.0]);
}
