//! Derivatives of network materials in f32, against dual numbers in f64.

use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::{Model, Neural, NeuralParameters, ParameterSet};
use glimpse_kernels::Dual;
use glimpse_materials::basis::{AngleDual, angles_to_f64};
use glimpse_materials::sampling::uniform_valid;
use glimpse_materials::{Brdf, Material};

use crate::network;

#[test]
fn network_derivatives_match_f64() {
    for seed in 0..20 {
        let network = network(seed);
        let mut weights = NeuralParameters::filled(AngleDual::from_value(0.0));
        for (weight, value) in weights.iter_mut().zip(network.parameters().iter()) {
            weight.value = (*value).into();
        }
        let angles = uniform_valid(100, seed);
        let mut batch = vec![Default::default(); angles.len()];
        network.brdf_batch_with_derivative(&angles, &mut batch);
        for (angles, in_batch) in angles.into_iter().zip(batch) {
            let (values, derivative) = network.brdf_with_derivative(angles);
            assert_eq!(values, network.at_angles(angles));
            let at = HalfDifference::from_angles(Dual::variables(angles_to_f64(&angles)));
            let (_, expected) = Dual::split(Neural::brdf::<AngleDual>(&weights, &at));
            for derivative in [derivative, in_batch.1] {
                let pairs = derivative
                    .as_flattened()
                    .iter()
                    .zip(expected.as_flattened());
                for (actual, expected) in pairs {
                    let error = (f64::from(*actual) - expected).abs();
                    let scale = 1.0 + expected.abs();
                    assert!(
                        error < 1e-4 * scale,
                        "network {seed} at {angles:?}: {actual}, {expected}"
                    );
                }
            }
        }
    }
}
