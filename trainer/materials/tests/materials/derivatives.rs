//! Derivatives of network materials in f32, against dual numbers in f64.

use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::{Model, Neural, NeuralParameters, ParameterSet};
use glimpse_kernels::Dual;
use glimpse_materials::Material;
use glimpse_materials::basis::AngleDual;
use glimpse_materials::sampling::uniform_valid;

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
        let results = network.with_derivatives(&angles);
        for (angles, (values, derivative)) in angles.into_iter().zip(results) {
            let at = HalfDifference::from_angles(Dual::variables(angles.map(f64::from)));
            let (expected_values, expected) = Dual::split(Neural::brdf::<AngleDual>(&weights, &at));
            let actual = values.iter().chain(derivative.as_flattened());
            let expected = expected_values.iter().chain(expected.as_flattened());
            for (actual, expected) in actual.zip(expected) {
                let error = (f64::from(*actual) - expected).abs();
                assert!(
                    error < 1e-4 * (1.0 + expected.abs()),
                    "network {seed} at {angles:?}: {actual}, {expected}"
                );
            }
        }
    }
}
