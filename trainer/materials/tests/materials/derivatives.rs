//! Derivatives of network materials against central differences.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::{Model, Neural, NeuralParameters, ParameterSet};
use glimpse_gradcheck::{Differences, Traced, gradient_scale, parameters};
use glimpse_materials::Material;
use glimpse_materials::sampling::uniform_valid;

use crate::network;

/// Returns the network's BRDF in f64, with every branch recorded.
fn brdf(weights: &NeuralParameters<f32>, [theta_h, theta_d, phi_d]: [f64; 3]) -> [Traced; 3] {
    let theta = parameters(
        weights.iter().map(|value| Traced((*value).into())),
        Traced(0.0),
    );
    let at = HalfDifference::from_angles(Angles {
        theta_h,
        theta_d,
        phi_d,
    });
    let [hx, hz, dx, dy, dz] = [at.hx, at.hz, at.dx, at.dy, at.dz].map(Traced);
    Neural::brdf(&theta, &HalfDifference { hx, hz, dx, dy, dz })
}

#[test]
fn network_derivatives_match_finite_differences() {
    // The derivatives are computed in f32.
    let mut differences = Differences::new(2e-4, 1e-4);
    for seed in 0..20 {
        let network = network(seed);
        for angles in uniform_valid(100, seed) {
            let (values, derivative) = network.brdf_with_derivative(angles);
            assert_eq!(values, network.brdf(angles));
            let center = [angles.theta_h, angles.theta_d, angles.phi_d].map(f64::from);
            let derivative = derivative.map(|channel| channel.map(f64::from));
            let scale = 100.0 * gradient_scale(derivative.as_flattened());
            for (channel, derivatives) in derivative.iter().enumerate() {
                for (i, derivative) in derivatives.iter().enumerate() {
                    let outcome =
                        differences.compare(&format!("angle {i}"), *derivative, scale, |offset| {
                            let mut moved = center;
                            moved[i] += offset;
                            brdf(network.parameters(), moved)[channel]
                        });
                    if let Err(error) = outcome {
                        panic!("network {seed} at {angles:?}: {error}");
                    }
                }
            }
        }
    }
    differences.assert_enough_compared("network derivatives", 9_000);
}
