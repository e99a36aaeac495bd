//! Tests of the procedural materials.

use super::*;
use crate::sampling::uniform_valid;
use glimpse_kernels::AngleDual;

#[test]
fn f32_is_close_to_f64() {
    let [mut max_error, mut max_derivative_error] = [0.0_f64; 2];
    for material in Procedural::set(60, 4) {
        for angles in uniform_valid(100, 10) {
            let at = HalfDifference::from_angles(AngleDual::variables(angles.map(f64::from)));
            let duals = material.evaluate(&at);
            let (exact, exact_derivative) = Dual::split(duals);
            let (with_derivative, derivative) = material.with_derivatives(&[angles])[0];
            let brdf = material.at_angles(angles);
            for channel in 0..3 {
                for value in [brdf[channel], with_derivative[channel]] {
                    let error = (f64::from(value) - exact[channel]).abs() / exact[channel];
                    max_error = max_error.max(error);
                }
                for angle in 0..3 {
                    let slope = exact_derivative[channel][angle];
                    let error = (f64::from(derivative[channel][angle]) - slope).abs();
                    max_derivative_error =
                        max_derivative_error.max(error / slope.abs().max(exact[channel]));
                }
            }
        }
    }
    assert!(max_error < 2e-4, "{max_error}");
    assert!(max_derivative_error < 5e-4, "{max_derivative_error}");
}

#[test]
fn materials_are_reciprocal_isotropic_and_positive() {
    for material in Procedural::set(60, 5) {
        for angles in uniform_valid(100, 11) {
            let angles = angles.map(f64::from);
            let brdf = material.evaluate(&HalfDifference::from_angles(angles));
            let exchanged = Angles {
                phi_d: angles.phi_d + PI,
                ..angles
            };
            let exchanged = material.evaluate(&HalfDifference::from_angles(exchanged));
            let brdf_at_pole = |phi_d| {
                let angles = Angles {
                    theta_h: 0.0,
                    phi_d,
                    ..angles
                };
                material.evaluate(&HalfDifference::from_angles(angles))[0]
            };
            assert!((brdf_at_pole(0.0) / brdf_at_pole(angles.phi_d) - 1.0).abs() < 1e-9);
            for (f, f_exchanged) in brdf.into_iter().zip(exchanged) {
                assert!(f > 0.0 && f.is_finite(), "{}: {f}", material.name());
                assert!(
                    (f - f_exchanged).abs() < 1e-9 * f,
                    "{}: {f}, exchanged {f_exchanged}",
                    material.name()
                );
            }
        }
    }
}
