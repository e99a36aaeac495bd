//! Tests of the procedural materials.

use super::*;
use crate::sampling::uniform_valid;

fn to_f64(angles: Angles<f32>) -> Angles<f64> {
    Angles {
        theta_h: angles.theta_h.into(),
        theta_d: angles.theta_d.into(),
        phi_d: angles.phi_d.into(),
    }
}

fn moved(angles: Angles<f64>, angle: usize, offset: f64) -> Angles<f64> {
    let mut moved = angles;
    *[&mut moved.theta_h, &mut moved.theta_d, &mut moved.phi_d][angle] += offset;
    moved
}

/// Returns true near a kink of the formula: where both cosines are nearly equal, or just above the horizon.
fn is_near_kink(angles: Angles<f64>) -> bool {
    let at = HalfDifference::from_angles(angles);
    let (cos_i, cos_o) = (at.cos_theta_i(), at.cos_theta_o());
    (cos_i - cos_o).abs() < 2e-3 || cos_i.min(cos_o) < 3e-3
}

#[test]
fn derivatives_match_finite_differences() {
    const STEP: f64 = 2e-5;
    let (mut compared, mut discarded, mut max_error) = (0, 0, 0.0_f64);
    for material in Procedural::set(60, 3) {
        for angles in uniform_valid(100, 9).into_iter().map(to_f64) {
            if is_near_kink(angles) {
                discarded += 1;
                continue;
            }
            let duals = material.evaluate(&HalfDifference::from_angles(Dual::<f64, 3>::variables(
                angles,
            )));
            let (values, derivative) = Dual::split(duals);
            for angle in [0, 1, 2] {
                let [far_low, low, high, far_high] = [-2.0, -1.0, 1.0, 2.0].map(|steps| {
                    material.evaluate(&HalfDifference::from_angles(moved(
                        angles,
                        angle,
                        steps * STEP,
                    )))
                });
                for channel in 0..3 {
                    let difference = (far_low[channel] - far_high[channel]
                        + 8.0 * (high[channel] - low[channel]))
                        / (12.0 * STEP);
                    let slope = derivative[channel][angle];
                    let error = (slope - difference).abs() / slope.abs().max(values[channel]);
                    max_error = max_error.max(error);
                    assert!(
                        error < 1e-5,
                        "{}: derivative {slope}, difference {difference}",
                        material.name()
                    );
                }
            }
            compared += 1;
        }
    }
    println!("{compared} compared, {discarded} at kinks, largest error {max_error:.1e}");
    assert!(
        compared > 5000 && discarded < 300,
        "{compared} compared, {discarded} discarded"
    );
}

#[test]
fn f32_is_close_to_f64() {
    let [mut max_error, mut max_derivative_error] = [0.0_f64; 2];
    for material in Procedural::set(60, 4) {
        for angles in uniform_valid(100, 10) {
            let duals = material.evaluate(&HalfDifference::from_angles(Dual::<f64, 3>::variables(
                to_f64(angles),
            )));
            let (exact, exact_derivative) = Dual::split(duals);
            let (with_derivative, derivative) = material.brdf_with_derivative(angles);
            let brdf = material.brdf(angles);
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
    println!("largest error in f32: {max_error}, of derivatives {max_derivative_error}");
    assert!(max_error < 2e-4, "{max_error}");
    assert!(max_derivative_error < 5e-4, "{max_derivative_error}");
}

#[test]
fn materials_are_reciprocal_isotropic_and_positive() {
    for material in Procedural::set(60, 5) {
        for angles in uniform_valid(100, 11).into_iter().map(to_f64) {
            let brdf = material.evaluate(&HalfDifference::from_angles(angles));
            let exchanged = material.evaluate(&HalfDifference::from_angles(moved(angles, 2, PI)));
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
