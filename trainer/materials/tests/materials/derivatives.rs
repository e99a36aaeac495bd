//! Derivatives of network materials against forward mode in double precision.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::{Model, Neural, NeuralParameters, ParameterSet};
use glimpse_gradcheck::{Forward, parameters};
use glimpse_kernels::Dual;
use glimpse_materials::Material;
use glimpse_materials::sampling::uniform_valid;

use crate::network;

/// Returns the network's BRDF in f64, with the derivatives with respect to an angle.
fn brdf(weights: &NeuralParameters<f32>, angles: Angles<f64>, angle: usize) -> [Forward; 3] {
    let weights = weights.iter().map(|value| Forward::fixed((*value).into()));
    let theta = parameters(weights, Forward::fixed(0.0));
    let at = HalfDifference::from_angles(Dual::<f64, 3>::variables(angles));
    let [hx, hz, dx, dy, dz] = [at.hx, at.hz, at.dx, at.dy, at.dz].map(|dual| Forward {
        value: dual.value,
        slope: dual.tangent[angle],
    });
    Neural::brdf(&theta, &HalfDifference { hx, hz, dx, dy, dz })
}

#[test]
fn network_derivatives_match_forward_mode() {
    let mut nonzero = 0;
    for seed in 0..20 {
        let network = network(seed);
        for angles in uniform_valid(100, seed) {
            let (values, derivatives) = network.brdf_with_derivative(angles);
            assert_eq!(values, network.brdf(angles));
            let largest = derivatives.as_flattened().iter();
            let largest = largest.fold(0.1_f32, |max, slope| max.max(slope.abs()));
            let precise = Angles {
                theta_h: angles.theta_h.into(),
                theta_d: angles.theta_d.into(),
                phi_d: angles.phi_d.into(),
            };
            for angle in 0..3 {
                let expected = brdf(network.parameters(), precise, angle);
                for (derivative, expected) in derivatives.iter().zip(expected) {
                    // The derivatives are computed in f32.
                    let error = f64::from(derivative[angle]) - expected.slope;
                    assert!(
                        error.abs() <= 1e-4 * f64::from(largest),
                        "network {seed}, angle {angle} at {angles:?}: {error}"
                    );
                    nonzero += usize::from(expected.slope != 0.0);
                }
            }
        }
    }
    assert!(nonzero > 9_000, "{nonzero}");
}
