//! Initial parameters for meta-training, and for the method Random.

use glimpse_core::model::{Model, ModelKind, Neural};
use rand::Rng;
use rand_distr::StandardNormal;

/// Draws initial parameters for schedule prior and for the optimum of a model.
///
/// Neural: weights uniform within a bound given by the fan-in of each layer, and outputs slightly above 0. An output
/// below 0 everywhere has no gradient and never recovers. Phong and Cook-Torrance: a gray, mostly diffuse material with
/// a soft highlight. Linear has no such parameters.
pub fn initial_guess(model: ModelKind, random: &mut impl Rng) -> Vec<f32> {
    match model {
        ModelKind::Neural => {
            // sqrt(3 / fan-in), where fan-in is the number of inputs that are not constant (5), or of hidden units
            // (21). The output weights are ten times smaller.
            let input_bound = (3.0_f32 / 5.0).sqrt();
            let hidden_bound = (3.0_f32 / 21.0).sqrt();
            network(
                random,
                [input_bound, hidden_bound, 0.1 * hidden_bound],
                0.15,
            )
        }
        ModelKind::Phong => vec![-1.0, -1.0, -1.0, 1.0, 1.0, 1.0, 2.5],
        ModelKind::CookTorrance => vec![-1.4, -1.4, -1.4, -1.0, -1.0, -1.0, -1.0, -2.5],
        _ => Vec::new(), // Linear
    }
}

/// Draws the initial parameters of the paper's method Random and of schedule paper. Neural: weights uniform in ±0.05 and no bias. Phong and
/// Cook-Torrance: standard normal parameters. Linear has no such parameters.
pub fn random_initialization(model: ModelKind, random: &mut impl Rng) -> Vec<f32> {
    match model {
        ModelKind::Neural => network(random, [0.05; 3], 0.0),
        ModelKind::Phong | ModelKind::CookTorrance => (0..model.parameters().unwrap_or(0))
            .map(|_| standard_normal(random))
            .collect(),
        _ => Vec::new(), // Linear
    }
}

/// Draws the parameters of Neural. The weights of each layer are uniform within its bound. Biases are 0, except those
/// of the outputs.
fn network(random: &mut impl Rng, bounds: [f32; 3], output_bias: f32) -> Vec<f32> {
    let [first, second, third] = bounds;
    let bounds = [Some(first), None, Some(second), None, Some(third), None];
    let mut parameters = Vec::with_capacity(Neural::PARAMETERS);
    for (length, bound) in Neural::LAYERS.into_iter().zip(bounds) {
        parameters.extend((0..length).map(|_| match bound {
            Some(bound) => random.random_range(-bound..bound),
            None => 0.0,
        }));
    }
    let outputs = parameters.iter_mut().rev().take(3);
    outputs.for_each(|bias| *bias = output_bias);
    parameters
}

/// Draws a standard normal number.
pub fn standard_normal(random: &mut impl Rng) -> f32 {
    random.sample(StandardNormal)
}
