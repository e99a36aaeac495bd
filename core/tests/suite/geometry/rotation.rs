//! Rotations of a pair of directions about the normal, which must not change the result of any model.

use std::f32::consts::{PI, TAU};

use glimpse_core::geometry::{ArmAngles, HalfDifference, Spherical};
use glimpse_core::model::{Model, Neural, NeuralParameters, ParameterSet};
use glimpse_core::recipe::Recipe;
use proptest::prelude::*;

/// The initial parameters of an example recipe.
fn neural() -> NeuralParameters<f32> {
    let bytes = include_bytes!("../../../examples/recipes/neural-n8.recipe");
    let recipe = Recipe::parse(bytes).expect("the example is valid");
    let descent = recipe.descent().expect("a recipe for Neural has a descent");
    let mut parameters = [0.0; Neural::PARAMETERS];
    for (parameter, value) in parameters.iter_mut().zip(descent.initial().iter()) {
        *parameter = value;
    }
    parameters
}

/// A pair of directions whose azimuths differ by `delta_phi`.
fn arms(theta_i: f32, theta_o: f32, delta_phi: f32) -> ArmAngles {
    let arm = |theta, phi| Spherical { theta, phi };
    ArmAngles {
        incoming: arm(theta_i, 0.0),
        outgoing: arm(theta_o, delta_phi),
    }
}

fn brdf(parameters: &NeuralParameters<f32>, arms: ArmAngles) -> [f32; 3] {
    let at = HalfDifference::from_directions(&arms.directions()).expect("a half vector");
    Neural::brdf::<f32>(parameters, &at)
}

/// The largest difference of a channel, relative to 1 + f, as in the logarithmic loss.
fn difference(a: [f32; 3], b: [f32; 3]) -> f32 {
    let relative = |(a, b): (f32, f32)| (a - b).abs() / (1.0 + a);
    a.into_iter().zip(b).map(relative).fold(0.0, f32::max)
}

/// An earlier version changed red from 0.1405 to 0.2002, because rounding determined the half vector's azimuth.
#[test]
fn neural_ignores_turn_of_mirror_pair() {
    let parameters = neural();
    for degrees in [0.5f32, 5.0, 30.0, 45.0, 60.0, 80.0, 85.0] {
        let theta = degrees.to_radians();
        let pair = arms(theta, theta, PI);
        let first = brdf(&parameters, pair);
        for turn in 0..3600 {
            let turned = pair.turned((turn as f32 / 10.0).to_radians());
            let actual = brdf(&parameters, turned);
            // Only theta_d changes: by up to 2e-7 rad due to rounding, and by 2e-6 rad due to micromath's square root.
            assert!(
                difference(first, actual) < 2e-5,
                "mirror at {degrees} degrees, turned by {}: {first:?} and {actual:?}",
                turn as f32 / 10.0
            );
        }
    }
}

/// Real arms are not exact, so small errors near the pole must not matter.
#[test]
fn neural_tolerates_arm_errors_of_0_01_degrees() {
    let parameters = neural();
    let theta = 30f32.to_radians();
    let exact = brdf(&parameters, arms(theta, theta, PI));
    for turn in 0..360 {
        let error = (turn as f32).to_radians().sin() * 1e-4;
        let near =
            arms(theta + error, theta - error, PI + error).turned((turn as f32).to_radians());
        assert!(difference(exact, brdf(&parameters, near)) < 1e-4);
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

    #[test]
    fn neural_ignores_turn(
        theta_i in 0.0..1.5f32, theta_o in 0.0..1.5f32, delta_phi in -PI..PI, turn in 0.0..TAU,
    ) {
        let pair = arms(theta_i, theta_o, delta_phi);
        let at = HalfDifference::from_directions(&pair.directions()).expect("a half vector");
        prop_assume!(at.hx < 2.9e-4 || at.hx > 3.1e-4);
        let parameters = neural();
        let accuracy = if at.hx > 0.0 { at.hx * at.dz } else { 1.0 };
        let actual = difference(brdf(&parameters, pair), brdf(&parameters, pair.turned(turn)));
        prop_assert!(actual <= 2e-5 + 3e-6 / accuracy, "{actual} at {pair:?}");
    }
}
