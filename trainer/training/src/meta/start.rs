//! Where initial parameters begin: for meta-training, and for the method Random.

use glimpse_core::model::{ModelKind, NeuralParameters, ParameterSet};
use rand::Rng;
use rand_distr::StandardNormal;

/// Where meta-training begins.
///
/// Neural: weights uniform within the reach of each layer's fan-in, and outputs a little above 0,
/// since one that is below 0 everywhere has no gradient and never recovers. Phong and
/// Cook-Torrance: a grey, mostly diffuse material with a soft highlight. Linear has no
/// such parameters.
pub fn first_guess(model: ModelKind, random: &mut impl Rng) -> Vec<f32> {
    match model {
        ModelKind::Neural => {
            let mut parameters = NeuralParameters::filled(0.0);
            let mut fill = |weights: &mut [f32], reach: f32| {
                for weight in weights {
                    *weight = random.random_range(-reach..reach);
                }
            };
            fill(parameters.fc1.as_flattened_mut(), (3.0_f32 / 5.0).sqrt());
            fill(parameters.fc2.as_flattened_mut(), (3.0_f32 / 21.0).sqrt());
            fill(
                parameters.fc3.as_flattened_mut(),
                0.1 * (3.0_f32 / 21.0).sqrt(),
            );
            parameters.b3 = [0.15; 3];
            parameters.iter().copied().collect()
        }
        ModelKind::Phong => vec![-1.0, -1.0, -1.0, 1.0, 1.0, 1.0, 2.5],
        ModelKind::CookTorrance => vec![-1.4, -1.4, -1.4, -1.0, -1.0, -1.0, -1.0, -2.5],
        _ => Vec::new(), // Linear
    }
}

/// Where the paper's method Random begins: Neural with weights uniform in +-0.05 and no bias,
/// Phong and Cook-Torrance with standard normal parameters. Linear has no such parameters.
pub fn random_start(model: ModelKind, random: &mut impl Rng) -> Vec<f32> {
    match model {
        ModelKind::Neural => {
            let mut parameters = NeuralParameters::filled(0.0);
            let NeuralParameters { fc1, fc2, fc3, .. } = &mut parameters;
            for weights in [
                fc1.as_flattened_mut(),
                fc2.as_flattened_mut(),
                fc3.as_flattened_mut(),
            ] {
                for weight in weights {
                    *weight = random.random_range(-0.05..0.05);
                }
            }
            parameters.iter().copied().collect()
        }
        ModelKind::Phong | ModelKind::CookTorrance => (0..model.parameters().unwrap_or(0))
            .map(|_| standard_normal(random))
            .collect(),
        _ => Vec::new(), // Linear
    }
}

/// A standard normal number.
pub fn standard_normal(random: &mut impl Rng) -> f32 {
    random.sample(StandardNormal)
}
