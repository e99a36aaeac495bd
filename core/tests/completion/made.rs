//! Recipes of made-up numbers, with every ingredient in the open.

use glimpse_core::fit::completion::Missing;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{
    Expectation, Ingredients, PackedCompletion, PackedDescent, PackedLearner, PackedStart, Recipe,
    RecipeError,
};

/// The models, by the sections that a recipe of each has.
pub(crate) const MODELS: [ModelKind; 4] = [
    ModelKind::Linear,
    ModelKind::Phong,
    ModelKind::CookTorrance,
    ModelKind::Neural,
];

/// SplitMix64.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// From -1 to 1.
    pub(crate) fn number(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1 << 23) as f32 - 1.0
    }

    pub(crate) fn numbers(&mut self, count: usize, size: f32) -> Vec<f32> {
        (0..count).map(|_| size * self.number()).collect()
    }

    fn weights(&mut self, count: usize) -> Vec<i8> {
        (0..count).map(|_| self.bits() as i8).collect()
    }

    /// Of one sign or the other, none near 0.
    fn scales(&mut self, count: usize, size: f32) -> Vec<f32> {
        let mut scale = || size / 127.0 * (0.7 + 0.3 * self.number()) * self.number().signum();
        (0..count).map(|_| scale()).collect()
    }
}

/// What goes into a section 1.
#[derive(Clone)]
pub(crate) struct Descends {
    pub(crate) model: ModelKind,
    pub(crate) inner_steps: u16,
    pub(crate) initial: Vec<f32>,
    pub(crate) step_sizes: Vec<f32>,
}

/// What goes into a section 4.
#[derive(Clone)]
pub(crate) struct Starts {
    pub(crate) hidden: Vec<i8>,
    pub(crate) hidden_scales: Vec<f32>,
    pub(crate) bias: Vec<f32>,
    pub(crate) output: Vec<i8>,
    pub(crate) output_scales: Vec<f32>,
}

/// What goes into a recipe that completes readings, as numbers.
#[derive(Clone)]
pub(crate) struct Made {
    /// (theta_h, theta_d, phi_d), n of them.
    pub(crate) pattern: Vec<f32>,
    pub(crate) components: usize,
    /// The number of a [`Missing`], or none.
    pub(crate) missing: u8,
    pub(crate) centre: Vec<f32>,
    pub(crate) scale: f32,
    pub(crate) readings: Vec<i8>,
    pub(crate) reading_scales: Vec<f32>,
    pub(crate) bias: Vec<f32>,
    pub(crate) output: Vec<i8>,
    pub(crate) output_scales: Vec<f32>,
    pub(crate) rows: Vec<i8>,
    pub(crate) row_scales: Vec<f32>,
    pub(crate) basis_checksum: u32,
    /// What goes into a section 133, if there is one.
    pub(crate) prediction: Option<Vec<f32>>,
    pub(crate) then: Option<(Descends, Starts)>,
}

/// How large a recipe is.
#[derive(Clone, Copy)]
pub(crate) struct Shape {
    /// n.
    pub(crate) samples: usize,
    /// m.
    pub(crate) components: usize,
    /// h.
    pub(crate) hidden: usize,
    /// g.
    pub(crate) units: usize,
}

/// A small one.
pub(crate) const SMALL: Shape = Shape {
    samples: SAMPLES,
    components: 4,
    hidden: 5,
    units: 3,
};
/// n of small ones.
pub(crate) const SAMPLES: usize = 6;
/// The numbers that Linear works in, for small ones: 4 (m + h).
pub(crate) const WORDS: usize = 36;

impl Made {
    /// Of pseudo-random numbers.
    pub(crate) fn new(model: ModelKind, shape: Shape, missing: Missing) -> Self {
        let Shape {
            samples: n,
            components: m,
            hidden: h,
            units: g,
        } = shape;
        let mut random = Random(7 + model as u64);
        let pattern = (0..n).flat_map(|k| {
            let k = k as f32;
            let (theta_h, theta_d) = ((0.618 * k).fract(), (0.311 * k).fract());
            [0.05 + 0.5 * theta_h, 0.1 + 0.7 * theta_d, 0.4 * k]
        });
        let rows = if model == ModelKind::Linear { m } else { 0 };
        let reading = 0.5 / n as f32;
        Self {
            pattern: pattern.collect(),
            components: m,
            missing: missing as u8,
            centre: random.numbers(n, 2.0).iter().map(|x| x + 4.0).collect(),
            scale: 0.6,
            readings: random.weights(n * 3 * (m + h)),
            reading_scales: random.scales(m + h, reading),
            bias: random.numbers(m + h, 0.4),
            output: random.weights(m * h),
            output_scales: random.scales(m, 0.5),
            rows: random.weights(n * rows),
            row_scales: random.scales(rows, 0.5),
            basis_checksum: if rows > 0 { 0xfeed_beef } else { 0 },
            prediction: None,
            then: model.parameters().map(|parameters| {
                let descends = Descends {
                    model,
                    inner_steps: 3,
                    initial: random.numbers(parameters, 0.4),
                    step_sizes: random.numbers(parameters, 0.05),
                };
                let starts = Starts {
                    hidden: random.weights(g * 3 * m),
                    hidden_scales: random.scales(g, 0.3),
                    bias: random.numbers(g, 0.4),
                    output: random.weights(parameters * g),
                    output_scales: random.scales(parameters, 0.2),
                };
                (descends, starts)
            }),
        }
    }

    /// A small one.
    pub(crate) fn small(model: ModelKind, missing: Missing) -> Self {
        Self::new(model, SMALL, missing)
    }

    /// h.
    pub(crate) fn hidden(&self) -> usize {
        self.bias.len() - self.components
    }

    /// As a recipe.
    pub(crate) fn write(&self) -> Result<Vec<u8>, RecipeError> {
        let then = self.then.as_ref();
        let then = then.map(|(descends, starts)| {
            let lists = (bytes(&descends.initial), bytes(&descends.step_sizes));
            let weights = (signed(&starts.hidden), signed(&starts.output));
            let scales = (bytes(&starts.hidden_scales), bytes(&starts.output_scales));
            (descends, lists, weights, scales, bytes(&starts.bias))
        });
        let then = then.as_ref();
        let then = then.map(|(descends, lists, weights, scales, bias)| {
            let descent = PackedDescent {
                model: descends.model,
                inner_steps: descends.inner_steps,
                initial: &lists.0,
                step_sizes: &lists.1,
            };
            let start = PackedStart {
                hidden: &weights.0,
                hidden_scales: &scales.0,
                bias,
                output: &weights.1,
                output_scales: &scales.1,
            };
            (descent, start)
        });
        let completion = PackedCompletion {
            components: self.components as u16,
            missing: self.missing,
            centre: &bytes(&self.centre),
            scale: self.scale,
            readings: &signed(&self.readings),
            reading_scales: &bytes(&self.reading_scales),
            bias: &bytes(&self.bias),
            output: &signed(&self.output),
            output_scales: &bytes(&self.output_scales),
            rows: &signed(&self.rows),
            row_scales: &bytes(&self.row_scales),
            basis_checksum: self.basis_checksum,
        };
        let pattern = bytes(&self.pattern);
        let learner = PackedLearner::Completed(completion, then);
        let prediction = self.prediction.as_deref().map(bytes);
        let ingredients = Ingredients {
            prediction: prediction.as_deref(),
            expectation: Some(Expectation {
                loss: 0.03,
                standard_error: None,
                materials: 0,
                on: "nothing",
            }),
            ..Ingredients::new(&pattern, learner)
        };
        let mut buffer = vec![0; 1 << 17];
        Recipe::write(&ingredients, &mut buffer).map(<[u8]>::to_vec)
    }
}

fn bytes(numbers: &[f32]) -> Vec<u8> {
    let bytes = numbers.iter().flat_map(|number| number.to_le_bytes());
    bytes.collect()
}

fn signed(weights: &[i8]) -> Vec<u8> {
    weights
        .iter()
        .map(|weight| weight.cast_unsigned())
        .collect()
}
