//! What a completion and a start begin with.

use glimpse_kernels::completion::Shape;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// The reach of what units say of parameters.
const OFFSETS: f32 = 0.02;

/// Random weights of a completion, and of a start; no bias, and nothing that a missing reading says.
pub(super) fn first_weights(shape: Shape, random: &mut ChaCha8Rng) -> [Vec<f32>; 2] {
    let mut uniform = |reach: f32| reach * (2.0 * random.random::<f32>() - 1.0);
    let [readings, bias, output] = shape.completion_lengths();
    let mut completion = Vec::with_capacity(readings + bias + output);
    let rows = shape.rows();
    let few = 1.0 / (shape.samples as f32).sqrt();
    for index in 0..readings {
        let (column, row) = (index / rows, index % rows);
        completion.push(match (row < shape.components, column % 3) {
            (_, 2) => 0.0,
            (true, _) => uniform(0.3 * few),
            (false, _) => uniform(few),
        });
    }
    completion.extend(std::iter::repeat_n(0.0, bias));
    let reach = 0.3 / (shape.hidden.max(1) as f32).sqrt();
    completion.extend((0..output).map(|_| uniform(reach)));

    let [hidden, bias, output] = shape.start_lengths();
    let reach = 1.0 / (3.0 * shape.components as f32).sqrt();
    let mut start: Vec<f32> = (0..hidden).map(|_| uniform(reach)).collect();
    start.extend(std::iter::repeat_n(0.0, bias));
    start.extend((0..output).map(|_| uniform(OFFSETS)));
    [completion, start]
}
