//! Random weights of both nets, random readings, and a score of the outputs. All numbers are representable in single
//! precision, so that all precisions have the same inputs.

use glimpse_kernels::completion::Shape;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// e, the offset of the mapping.
pub(super) const EPSILON: f64 = 1e-3;
/// The number of materials: larger than the number of the widest lanes, and not a multiple of it.
const MATERIALS: usize = 41;

/// Readings of materials, and the weights of both nets.
pub(super) struct Case {
    pub(super) shape: Shape,
    pub(super) materials: usize,
    /// The weights of the coefficient net (readings, bias and W), then of the start net (P, p and U).
    pub(super) weights: [Vec<f64>; 6],
    /// The initial parameters to which the start net adds its offsets.
    pub(super) initial: Vec<f64>,
    /// w = cos(theta_i) cos(theta_o) of each sample.
    pub(super) cosine_products: Vec<f64>,
    /// The center of each sample's logarithms, and their common scale; see
    /// [`standardized`](glimpse_core::fit::coefficient_net::standardized).
    pub(super) center: Vec<f64>,
    pub(super) scale: f64,
    /// The readings of each sample of each material: three channels, or None if missing.
    pub(super) readings: Vec<Option<[f64; 3]>>,
    /// The weights of the squared coefficients in the score. The score is half the weighted sum of squares of all
    /// coefficients and initial parameters, so its gradient depends on the outputs.
    pub(super) coefficient_score_weights: Vec<f64>,
    /// The weights of the squared initial parameters in the score.
    pub(super) initial_score_weights: Vec<f64>,
}

/// Returns a random number in (-size, size) that single precision represents.
fn number(random: &mut ChaCha8Rng, size: f64) -> f64 {
    f64::from((size * random.random_range(-1.0..1.0_f64)) as f32)
}

fn numbers(random: &mut ChaCha8Rng, count: usize, size: f64) -> Vec<f64> {
    (0..count).map(|_| number(random, size)).collect()
}

/// Returns the largest random weight of each list. Hidden units do not saturate at these, for any number of inputs.
fn max_weights(shape: Shape) -> [f64; 6] {
    let Shape {
        samples,
        components,
        hidden,
        units,
        ..
    } = shape;
    let inverse_root = |count: usize| 1.0 / (count.max(1) as f64).sqrt();
    [
        inverse_root(samples),
        0.5,
        1.5 * inverse_root(hidden),
        inverse_root(3 * components),
        0.5,
        inverse_root(units),
    ]
}

fn lengths(shape: Shape) -> [usize; 6] {
    let [a, b, c] = shape.coefficient_net_lengths();
    let [d, e, f] = shape.start_net_lengths();
    [a, b, c, d, e, f]
}

impl Case {
    /// Creates a case in which each reading is missing with the given probability. The first material always has all
    /// readings. The second has only its first reading if the probability is not 0.
    pub(super) fn new(shape: Shape, missing: f64) -> Self {
        let seed = [
            shape.samples,
            shape.components,
            shape.hidden,
            shape.parameters,
        ];
        let seed = seed.iter().fold(5, |seed, count| 1000 * seed + count);
        let mut random = ChaCha8Rng::seed_from_u64(seed as u64);
        let (max_weights, lengths) = (max_weights(shape), lengths(shape));
        let weights =
            std::array::from_fn(|list| numbers(&mut random, lengths[list], max_weights[list]));
        let reading = |random: &mut ChaCha8Rng, index: usize| {
            let (material, sample) = (index / shape.samples, index % shape.samples);
            let is_missing = match material {
                0 => false,
                1 => sample > 0 && missing > 0.0,
                _ => random.random_bool(missing),
            };
            // Dark and bright readings; some are negative, as with noise.
            let mut value = || match random.random_bool(0.05) {
                true => -4e-4,
                false => random.random_range(-6.0..1.5_f64).exp(),
            };
            let channels = [(); 3].map(|()| f64::from(value() as f32));
            (!is_missing).then_some(channels)
        };
        let indices = 0..MATERIALS * shape.samples;
        Self {
            shape,
            materials: MATERIALS,
            weights,
            initial: numbers(&mut random, shape.parameters, 0.5),
            cosine_products: numbers(&mut random, shape.samples, 0.4)
                .iter()
                .map(|number| f64::from((number + 0.5) as f32))
                .collect(),
            center: numbers(&mut random, shape.samples, 1.0)
                .iter()
                .map(|number| f64::from((number + 4.0) as f32))
                .collect(),
            scale: f64::from(0.6_f32),
            readings: indices.map(|index| reading(&mut random, index)).collect(),
            coefficient_score_weights: numbers(&mut random, MATERIALS * 3 * shape.components, 1.0),
            initial_score_weights: numbers(&mut random, MATERIALS * shape.parameters, 1.0),
        }
    }

    /// Converts derivatives with respect to the readings y of each channel to derivatives with respect to ln(y w + e),
    /// which have a similar magnitude for dark and bright readings.
    pub(super) fn by_logarithms(&self, by_readings: &[Vec<f64>; 3]) -> Vec<f64> {
        let mut by_logarithms = Vec::new();
        for (index, reading) in self.readings.iter().enumerate() {
            let weight = self.cosine_products[index % self.shape.samples];
            for (value, by_reading) in reading.unwrap_or_default().iter().zip(by_readings) {
                by_logarithms.push(match reading {
                    Some(_) => by_reading[index] * (value * weight + EPSILON) / weight,
                    None => 0.0,
                });
            }
        }
        by_logarithms
    }
}
