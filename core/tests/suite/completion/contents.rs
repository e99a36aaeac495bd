//! Synthetic recipes that complete readings, with accessible fields.

use glimpse_core::fit::coefficient_net::MissingPolicy;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{
    ExpectedLoss, PackedCoefficientNet, PackedDescent, PackedInitNet, PackedMethod, PackedTarget,
    Recipe, RecipeError, RecipeParts,
};

use crate::random::Random;
use crate::recipes::{packed, parsed, write};

fn weights(random: &mut Random, count: usize) -> Vec<i8> {
    (0..count).map(|_| random.bits() as i8).collect()
}

/// Scales of either sign, none near 0.
fn scales(random: &mut Random, count: usize, size: f32) -> Vec<f32> {
    let mut scale = || size / 127.0 * (0.7 + 0.3 * random.number()) * random.number().signum();
    (0..count).map(|_| scale()).collect()
}

/// The contents of section 1.
#[derive(Clone)]
pub(crate) struct DescentPart {
    pub(crate) model: ModelKind,
    pub(crate) inner_steps: u16,
    pub(crate) initial: Vec<f32>,
    pub(crate) step_sizes: Vec<f32>,
}

/// The contents of section 4.
#[derive(Clone)]
pub(crate) struct InitNetPart {
    pub(crate) hidden: Vec<i8>,
    pub(crate) hidden_scales: Vec<f32>,
    pub(crate) bias: Vec<f32>,
    pub(crate) output: Vec<i8>,
    pub(crate) output_scales: Vec<f32>,
}

/// The contents of a recipe that completes readings.
#[derive(Clone)]
pub(crate) struct CompletedContents {
    /// n triples (theta_h, theta_d, phi_d).
    pub(crate) pattern: Vec<f32>,
    pub(crate) components: usize,
    /// The number of a [`MissingPolicy`], or an invalid number.
    pub(crate) missing: u8,
    pub(crate) center: Vec<f32>,
    pub(crate) scale: f32,
    pub(crate) readings: Vec<i8>,
    pub(crate) reading_scales: Vec<f32>,
    pub(crate) bias: Vec<f32>,
    pub(crate) output: Vec<i8>,
    pub(crate) output_scales: Vec<f32>,
    pub(crate) rows: Vec<i8>,
    pub(crate) row_scales: Vec<f32>,
    pub(crate) basis_checksum: u32,
    /// The contents of section 133, if present.
    pub(crate) prediction: Option<Vec<f32>>,
    pub(crate) descent: Option<(DescentPart, InitNetPart)>,
}

/// The numbers of samples n, components m, hidden units h, and units of an init net g.
pub(crate) type Shape = [usize; 4];
pub(crate) const SMALL: Shape = [SAMPLES, 4, 5, 3];
/// n of small recipes.
pub(crate) const SAMPLES: usize = 6;

impl CompletedContents {
    /// Contents of pseudo-random numbers.
    pub(crate) fn new(model: ModelKind, shape: Shape, missing: MissingPolicy) -> Self {
        let [n, m, h, g] = shape;
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
            center: random.numbers(n, 2.0).iter().map(|x| x + 4.0).collect(),
            scale: 0.6,
            readings: weights(&mut random, n * 3 * (m + h)),
            reading_scales: scales(&mut random, m + h, reading),
            bias: random.numbers(m + h, 0.4),
            output: weights(&mut random, m * h),
            output_scales: scales(&mut random, m, 0.5),
            rows: weights(&mut random, n * rows),
            row_scales: scales(&mut random, rows, 0.5),
            basis_checksum: if rows > 0 { 0xfeed_beef } else { 0 },
            prediction: None,
            descent: model.parameters().map(|parameters| {
                let descent_part = DescentPart {
                    model,
                    inner_steps: 3,
                    initial: random.numbers(parameters, 0.4),
                    step_sizes: random.numbers(parameters, 0.05),
                };
                let init_net_part = InitNetPart {
                    hidden: weights(&mut random, g * 3 * m),
                    hidden_scales: scales(&mut random, g, 0.3),
                    bias: random.numbers(g, 0.4),
                    output: weights(&mut random, parameters * g),
                    output_scales: scales(&mut random, parameters, 0.2),
                };
                (descent_part, init_net_part)
            }),
        }
    }

    /// Contents of a small recipe.
    pub(crate) fn small(model: ModelKind, missing: MissingPolicy) -> Self {
        Self::new(model, SMALL, missing)
    }

    pub(crate) fn model(&self) -> ModelKind {
        let descent = self.descent.as_ref();
        descent.map_or(ModelKind::Linear, |(descent_part, _)| descent_part.model)
    }

    /// The number of hidden units, h.
    pub(crate) fn hidden(&self) -> usize {
        self.bias.len() - self.components
    }

    pub(crate) fn write(&self) -> Result<Vec<u8>, RecipeError> {
        let target = self.descent.as_ref().map(|(descent_part, init_net_part)| {
            let descent = PackedDescent {
                model: descent_part.model,
                inner_steps: descent_part.inner_steps,
                initial: packed(&descent_part.initial).leak(),
                step_sizes: packed(&descent_part.step_sizes).leak(),
            };
            let start = PackedInitNet {
                hidden: signed(&init_net_part.hidden).leak(),
                hidden_scales: packed(&init_net_part.hidden_scales).leak(),
                bias: packed(&init_net_part.bias).leak(),
                output: signed(&init_net_part.output).leak(),
                output_scales: packed(&init_net_part.output_scales).leak(),
            };
            PackedTarget::Descent(descent, start)
        });
        let target = target.unwrap_or(PackedTarget::Linear);
        let completion = PackedCoefficientNet {
            components: self.components as u16,
            missing: self.missing,
            center: &packed(&self.center),
            scale: self.scale,
            readings: &signed(&self.readings),
            reading_scales: &packed(&self.reading_scales),
            bias: &packed(&self.bias),
            output: &signed(&self.output),
            output_scales: &packed(&self.output_scales),
            rows: &signed(&self.rows),
            row_scales: &packed(&self.row_scales),
            basis_checksum: self.basis_checksum,
        };
        let pattern = packed(&self.pattern);
        let prediction = self.prediction.as_deref().map(packed);
        write(&RecipeParts {
            prediction: prediction.as_deref(),
            expectation: Some(ExpectedLoss {
                loss: 0.03,
                standard_error: None,
                materials: 0,
                on: "nothing",
            }),
            ..RecipeParts::new(&pattern, PackedMethod::Completed(completion, None, target))
        })
    }

    pub(crate) fn recipe(&self) -> Recipe<'static> {
        parsed(self.write().unwrap())
    }
}

fn signed(weights: &[i8]) -> Vec<u8> {
    let weights = weights.iter().map(|weight| weight.cast_unsigned());
    weights.collect()
}
