//! Random weights of a completion and of a start, readings of some materials, and a score of what
//! comes of them. All numbers are those of single precision, so that it is asked the same.

use glimpse_kernels::completion::Shape;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// e of the mapping.
pub(super) const EPSILON: f64 = 1e-3;
/// Not a multiple of what fits into registers side by side, and more than fit at once.
const MATERIALS: usize = 41;

/// How large a completion and its start are.
pub(super) type Size = Shape;

/// Some materials, and what completes their readings.
pub(super) struct Case {
    pub(super) size: Size,
    pub(super) materials: usize,
    /// Of the completion: readings, bias and W; of the start: P, p and U.
    pub(super) weights: [Vec<f64>; 6],
    /// What a start adds to.
    pub(super) initial: Vec<f64>,
    /// cos(theta_i) cos(theta_o) of each sample.
    pub(super) cosines: Vec<f64>,
    pub(super) center: Vec<f64>,
    pub(super) scale: f64,
    /// Material by material, sample by sample: three channels, or that it is missing.
    pub(super) readings: Vec<Option<[f64; 3]>>,
    /// The score is half the sum of squares, of coefficients times these and of initial parameters
    /// times those: it depends on all of them, and its slopes on what was found.
    pub(super) by_coefficients: Vec<f64>,
    pub(super) by_initial: Vec<f64>,
}

/// A number of single precision.
fn number(random: &mut ChaCha8Rng, size: f64) -> f64 {
    f64::from((size * random.random_range(-1.0..1.0_f64)) as f32)
}

fn numbers(random: &mut ChaCha8Rng, count: usize, size: f64) -> Vec<f64> {
    (0..count).map(|_| number(random, size)).collect()
}

/// Sizes of weights that leave units between their ends, however many there are.
fn spreads(size: Size) -> [f64; 6] {
    let Size {
        samples,
        components,
        hidden,
        units,
        ..
    } = size;
    let share = |count: usize| 1.0 / (count.max(1) as f64).sqrt();
    [
        share(samples),
        0.5,
        1.5 * share(hidden),
        share(3 * components),
        0.5,
        share(units),
    ]
}

fn lengths(size: Size) -> [usize; 6] {
    let [a, b, c] = size.completion_lengths();
    let [d, e, f] = size.start_lengths();
    [a, b, c, d, e, f]
}

impl Case {
    /// With a share of the readings missing; of the first material all are there, and one is of the
    /// second.
    pub(super) fn new(size: Size, missing: f64) -> Self {
        let seed = [size.samples, size.components, size.hidden, size.parameters];
        let seed = seed.iter().fold(5, |seed, count| 1000 * seed + count);
        let mut random = ChaCha8Rng::seed_from_u64(seed as u64);
        let (spreads, lengths) = (spreads(size), lengths(size));
        let weights =
            std::array::from_fn(|list| numbers(&mut random, lengths[list], spreads[list]));
        let reading = |random: &mut ChaCha8Rng, place: usize| {
            let (material, sample) = (place / size.samples, place % size.samples);
            let is_missing = match material {
                0 => false,
                1 => sample > 0 && missing > 0.0,
                _ => random.random_bool(missing),
            };
            // Dark ones and bright ones alike, some as far below 0 as noise leaves them.
            let mut value = || match random.random_bool(0.05) {
                true => -4e-4,
                false => random.random_range(-6.0..1.5_f64).exp(),
            };
            let channels = [(); 3].map(|()| f64::from(value() as f32));
            (!is_missing).then_some(channels)
        };
        let places = 0..MATERIALS * size.samples;
        Self {
            size,
            materials: MATERIALS,
            weights,
            initial: numbers(&mut random, size.parameters, 0.5),
            cosines: numbers(&mut random, size.samples, 0.4)
                .iter()
                .map(|number| f64::from((number + 0.5) as f32))
                .collect(),
            center: numbers(&mut random, size.samples, 1.0)
                .iter()
                .map(|number| f64::from((number + 4.0) as f32))
                .collect(),
            scale: f64::from(0.6_f32),
            readings: places.map(|place| reading(&mut random, place)).collect(),
            by_coefficients: numbers(&mut random, MATERIALS * 3 * size.components, 1.0),
            by_initial: numbers(&mut random, MATERIALS * size.parameters, 1.0),
        }
    }

    /// 1 where a reading is missing, else 0: a row for each material.
    pub(super) fn absent(&self) -> Vec<f64> {
        let readings = self.readings.iter();
        readings
            .map(|reading| f64::from(u8::from(reading.is_none())))
            .collect()
    }

    /// What was read of a channel, a row for each material; whatever a logarithm can be taken of
    /// where it is missing.
    pub(super) fn channel(&self, channel: usize) -> Vec<f64> {
        let readings = self.readings.iter();
        readings
            .map(|reading| reading.unwrap_or([1.0; 3])[channel])
            .collect()
    }

    /// Slopes by the readings of each channel, as those by ln(y w + e): all of a size, for bright
    /// readings and dark ones.
    pub(super) fn by_logarithms(&self, slopes: &[Vec<f64>; 3]) -> Vec<f64> {
        let mut by_logarithms = Vec::new();
        for (place, reading) in self.readings.iter().enumerate() {
            let cosines = self.cosines[place % self.size.samples];
            for (value, slopes) in reading.unwrap_or_default().iter().zip(slopes) {
                by_logarithms.push(match reading {
                    Some(_) => slopes[place] * (value * cosines + EPSILON) / cosines,
                    None => 0.0,
                });
            }
        }
        by_logarithms
    }
}
