//! Rotations of a pair of directions about the normal, which must not change half and difference vectors, and so no
//! model's result.

use std::f32::consts::{PI, TAU};

use glimpse_core::geometry::{Arms, HalfDifference};
use proptest::prelude::*;

/// A pair of directions whose azimuths differ by `delta_phi`.
fn arms(theta_i: f32, theta_o: f32, delta_phi: f32) -> Arms {
    Arms::from_array([theta_i, 0.0, theta_o, delta_phi])
}

/// Arms that are off by 0.01 degrees still yield the half vector of a mirror pair.
#[test]
fn arm_errors_keep_half_vector_at_pole() {
    let theta = 30f32.to_radians();
    for turn in (0..360).map(|degrees| (degrees as f32).to_radians()) {
        let error = turn.sin() * 1e-4;
        let near = arms(theta + error, theta - error, PI + error).turned(turn);
        let at = HalfDifference::from_directions(&near.directions()).expect("a half vector");
        assert_eq!((at.hx, at.dy), (0.0, 0.0));
        assert!((at.dz - theta.cos()).abs() < 1e-4);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 10_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn turn_keeps_half_and_difference_vectors(
        theta_i in 0.0..1.5f32, theta_o in 0.0..1.5f32, delta_phi in -PI..PI, turn in 0.0..TAU,
    ) {
        let pair = arms(theta_i, theta_o, delta_phi);
        let turned_angles = pair.turned(turn).directions();
        let turned_vectors = pair.directions().turned(turn);
        let [original, turned_angles, turned_vectors] = [pair.directions(), turned_angles, turned_vectors].map(|directions| {
            HalfDifference::from_directions(&directions).expect("a half vector")
        });
        // At sin(theta_h) = `POLE`, 3e-4, rounding decides if phi_d becomes 0.
        prop_assume!(original.hx < 2.9e-4 || original.hx > 3.1e-4);
        // The azimuth of the sum of both directions has an error of 1 / (sin(theta_h) cos(theta_d)), times that of
        // rounding.
        let accuracy = if original.hx > 0.0 { original.hx * original.dz } else { 1.0 };
        let rounding = if cfg!(feature = "micromath") { 5e-6 } else { 0.0 };
        let tolerance = rounding + 1e-6 / accuracy;
        for at in [turned_angles, turned_vectors] {
            let pairs = [
                (at.hx, original.hx),
                (at.hz, original.hz),
                (at.dx, original.dx),
                (at.dy, original.dy),
                (at.dz, original.dz),
            ];
            for (a, b) in pairs {
                prop_assert!((a - b).abs() <= tolerance, "{original:?} {at:?}");
            }
        }
    }
}
