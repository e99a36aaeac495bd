//! Random initial weights of CoefficientNet and InitNet.

use glimpse_kernels::completion::Shape;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// The bound of the initial output weights of the InitNet.
const OUTPUT_BOUND: f32 = 0.02;

/// Draws initial weights of CoefficientNet and InitNet. Biases, and the weights of the missing-reading inputs, are 0.
pub(super) fn initial_weights(shape: Shape, random: &mut ChaCha8Rng) -> [Vec<f32>; 2] {
    let mut uniform = |bound: f32| bound * (2.0 * random.random::<f32>() - 1.0);
    let [readings, bias, output] = shape.coefficient_net_lengths();
    let mut coefficient_net = Vec::with_capacity(readings + bias + output);
    let rows = shape.rows();
    let bound = 1.0 / (shape.samples as f32).sqrt();
    for index in 0..readings {
        let (column, row) = (index / rows, index % rows);
        coefficient_net.push(match (row < shape.components, column % 3) {
            (_, 2) => 0.0,
            (true, _) => uniform(0.3 * bound),
            (false, _) => uniform(bound),
        });
    }
    coefficient_net.extend(std::iter::repeat_n(0.0, bias));
    let bound = 0.3 / (shape.hidden.max(1) as f32).sqrt();
    coefficient_net.extend((0..output).map(|_| uniform(bound)));

    let [hidden, bias, output] = shape.init_net_lengths();
    let bound = 1.0 / (3.0 * shape.components as f32).sqrt();
    let mut init_net: Vec<f32> = (0..hidden).map(|_| uniform(bound)).collect();
    init_net.extend(std::iter::repeat_n(0.0, bias));
    init_net.extend((0..output).map(|_| uniform(OUTPUT_BOUND)));
    [coefficient_net, init_net]
}
