//! Random initial weights of CoefficientNet and StartNet.

use glimpse_kernels::completion::Shape;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// The bound of the initial output weights of the StartNet.
const OUTPUT_BOUND: f32 = 0.02;

/// Draws initial weights of CoefficientNet and StartNet. Biases are 0, and so are the weights of the inputs that mark
/// missing readings.
pub(super) fn initial_weights(shape: Shape, random: &mut ChaCha8Rng) -> [Vec<f32>; 2] {
    let mut uniform = |bound: f32| bound * (2.0 * random.random::<f32>() - 1.0);
    let [reading_count, bias_count, output_count] = shape.coefficient_net_lengths();
    let mut coefficient_net = Vec::with_capacity(reading_count + bias_count + output_count);
    let rows = shape.rows();
    let bound = 1.0 / (shape.samples as f32).sqrt();
    for index in 0..reading_count {
        let (column, row) = (index / rows, index % rows);
        // The last of a sample's three inputs marks a missing reading. The first rows are coefficients, the others
        // hidden units.
        coefficient_net.push(match (row < shape.components, column % 3) {
            (_, 2) => 0.0,
            (true, _) => uniform(0.3 * bound),
            (false, _) => uniform(bound),
        });
    }
    coefficient_net.extend(std::iter::repeat_n(0.0, bias_count));
    let bound = 0.3 / (shape.hidden.max(1) as f32).sqrt();
    coefficient_net.extend((0..output_count).map(|_| uniform(bound)));

    let [hidden_count, bias_count, output_count] = shape.start_net_lengths();
    let bound = 1.0 / (3.0 * shape.components as f32).sqrt();
    let mut start_net: Vec<f32> = (0..hidden_count).map(|_| uniform(bound)).collect();
    start_net.extend(std::iter::repeat_n(0.0, bias_count));
    start_net.extend((0..output_count).map(|_| uniform(OUTPUT_BOUND)));
    [coefficient_net, start_net]
}
