//! Synthetic recipes that complete readings, with accessible fields.

use glimpse_core::fit::Uncertainty;
use glimpse_core::fit::coefficient_net::MissingPolicy;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{Kind, Recipe};
use serde::Serialize;

use crate::random::Random;
use crate::recipes::{expectation, numbers, packed, parsed, recipe_with, section};
use crate::scanning::MODELS;

fn weights(random: &mut Random, count: usize) -> Vec<i8> {
    (0..count).map(|_| random.bits() as i8).collect()
}

/// Scales of either sign, none near 0.
fn scales(random: &mut Random, count: usize, size: f32) -> Vec<f32> {
    let mut scale = || size / 127.0 * (0.7 + 0.3 * random.number()) * random.number().signum();
    (0..count).map(|_| scale()).collect()
}

/// Numbers from half of `size` to `size`.
fn positive(random: &mut Random, count: usize, size: f32) -> Vec<f32> {
    let numbers = random.numbers(count, 0.25 * size).into_iter();
    numbers.map(|number| 0.75 * size + number).collect()
}

/// The contents of section 1.
#[derive(Clone, Serialize)]
pub(crate) struct DescentPart {
    pub(crate) model: ModelKind,
    pub(crate) inner_steps: u16,
    #[serde(serialize_with = "numbers")]
    pub(crate) initial: Vec<f32>,
    #[serde(serialize_with = "numbers")]
    pub(crate) step_sizes: Vec<f32>,
}

/// The contents of section 4.
#[derive(Clone, Serialize)]
pub(crate) struct InitNetPart {
    pub(crate) hidden: Vec<i8>,
    #[serde(serialize_with = "numbers")]
    pub(crate) hidden_scales: Vec<f32>,
    #[serde(serialize_with = "numbers")]
    pub(crate) bias: Vec<f32>,
    pub(crate) output: Vec<i8>,
    #[serde(serialize_with = "numbers")]
    pub(crate) output_scales: Vec<f32>,
}

/// The contents of section 5.
#[derive(Clone, Serialize)]
pub(crate) struct GaussNewtonPart {
    pub(crate) model: ModelKind,
    pub(crate) steps: u16,
    #[serde(serialize_with = "numbers")]
    pub(crate) initial: Vec<f32>,
    #[serde(serialize_with = "numbers")]
    pub(crate) precision: Vec<f32>,
    pub(crate) reading_weight: f32,
    pub(crate) error_scale: f32,
    /// V triples (theta_h, theta_d, phi_d).
    #[serde(serialize_with = "numbers")]
    pub(crate) directions: Vec<f32>,
    #[serde(serialize_with = "numbers")]
    pub(crate) center: Vec<f32>,
    pub(crate) rows: Vec<i8>,
    #[serde(serialize_with = "numbers")]
    pub(crate) row_scales: Vec<f32>,
}

/// The contents of section 6.
#[derive(Clone, Serialize)]
pub(crate) struct CorrectionPart {
    pub(crate) rows: Vec<i8>,
    #[serde(serialize_with = "numbers")]
    pub(crate) row_scales: Vec<f32>,
    #[serde(serialize_with = "numbers")]
    pub(crate) precision: Vec<f32>,
}

/// The contents of section 137.
#[derive(Clone, Serialize)]
pub(crate) struct PartialPart {
    #[serde(serialize_with = "numbers")]
    pub(crate) loss: Vec<f32>,
    #[serde(serialize_with = "numbers")]
    pub(crate) bound: Vec<f32>,
}

/// The contents of a recipe that completes readings.
#[derive(Clone, Serialize)]
pub(crate) struct CompletedContents {
    /// n triples (theta_h, theta_d, phi_d).
    #[serde(skip)]
    pub(crate) pattern: Vec<f32>,
    pub(crate) components: usize,
    /// The number of a [`MissingPolicy`], or an invalid number.
    pub(crate) missing: u8,
    #[serde(serialize_with = "numbers")]
    pub(crate) center: Vec<f32>,
    pub(crate) scale: f32,
    pub(crate) readings: Vec<i8>,
    #[serde(serialize_with = "numbers")]
    pub(crate) reading_scales: Vec<f32>,
    #[serde(serialize_with = "numbers")]
    pub(crate) bias: Vec<f32>,
    pub(crate) output: Vec<i8>,
    #[serde(serialize_with = "numbers")]
    pub(crate) output_scales: Vec<f32>,
    pub(crate) rows: Vec<i8>,
    #[serde(serialize_with = "numbers")]
    pub(crate) row_scales: Vec<f32>,
    pub(crate) basis_checksum: u32,
    /// The contents of section 133, if present.
    #[serde(skip)]
    pub(crate) prediction: Option<Vec<f32>>,
    /// The contents of section 135, if present.
    #[serde(skip)]
    pub(crate) uncertainty: Option<Uncertainty>,
    /// The contents of section 137, if present.
    #[serde(skip)]
    pub(crate) partial: Option<PartialPart>,
    #[serde(skip)]
    pub(crate) descent: Option<DescentPart>,
    /// Present with a descent or with Gauss-Newton steps.
    #[serde(skip)]
    pub(crate) init_net: Option<InitNetPart>,
    #[serde(skip)]
    pub(crate) gauss_newton: Option<GaussNewtonPart>,
    #[serde(skip)]
    pub(crate) correction: Option<CorrectionPart>,
}

/// The numbers of samples n, components m, hidden units h, and units of an init net g.
pub(crate) type Shape = [usize; 4];
pub(crate) const SMALL: Shape = [SAMPLES, 4, 5, 3];
/// K of small recipes with a correction.
pub(crate) const CORRECTED: usize = 6;
/// n of small recipes.
pub(crate) const SAMPLES: usize = 6;
/// V, the number of virtual readings.
pub(crate) const VIRTUAL_READINGS: usize = 7;

/// The triples (theta_h, theta_d, phi_d) of `count` directions above the horizon.
fn directions(count: usize, factors: [f32; 2]) -> Vec<f32> {
    let [by_theta_h, by_theta_d] = factors;
    let angles = (0..count).flat_map(|k| {
        let k = k as f32;
        let (theta_h, theta_d) = ((by_theta_h * k).fract(), (by_theta_d * k).fract());
        [0.05 + 0.5 * theta_h, 0.1 + 0.7 * theta_d, 0.4 * k]
    });
    angles.collect()
}

impl CompletedContents {
    /// Contents of pseudo-random numbers.
    pub(crate) fn new(model: ModelKind, shape: Shape, missing: MissingPolicy) -> Self {
        let [n, m, h, g] = shape;
        let mut random = Random(7 + model as u64);
        let rows = if model == ModelKind::Linear { m } else { 0 };
        let reading = 0.5 / n as f32;
        Self {
            pattern: directions(n, [0.618, 0.311]),
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
            uncertainty: None,
            partial: None,
            descent: model.parameters().map(|parameters| DescentPart {
                model,
                inner_steps: 3,
                initial: random.numbers(parameters, 0.4),
                step_sizes: random.numbers(parameters, 0.05),
            }),
            init_net: model.parameters().map(|parameters| InitNetPart {
                hidden: weights(&mut random, g * 3 * m),
                hidden_scales: scales(&mut random, g, 0.3),
                bias: random.numbers(g, 0.4),
                output: weights(&mut random, parameters * g),
                output_scales: scales(&mut random, parameters, 0.2),
            }),
            gauss_newton: None,
            correction: None,
        }
    }

    /// Adds a correction with K components.
    pub(crate) fn corrected(mut self, components: usize) -> Self {
        let mut random = Random(17 + components as u64);
        let samples = self.center.len();
        self.rows.clear();
        self.row_scales.clear();
        if let Some(init_net_part) = &mut self.init_net {
            let units = init_net_part.bias.len();
            init_net_part.hidden = weights(&mut random, units * 3 * components);
        }
        self.correction = Some(CorrectionPart {
            rows: weights(&mut random, samples * components),
            row_scales: scales(&mut random, components, 0.5),
            precision: positive(&mut random, components, 1.0),
        });
        self
    }

    /// Replaces the descent by Gauss-Newton steps.
    pub(crate) fn stepped(mut self) -> Self {
        let DescentPart { model, initial, .. } = self.descent.take().unwrap();
        let mut random = Random(27 + model as u64);
        let active = match model {
            ModelKind::Neural => 22,
            _ => initial.len(),
        };
        let components = self.fitted_components();
        let center = random.numbers(VIRTUAL_READINGS, 2.0).into_iter();
        self.gauss_newton = Some(GaussNewtonPart {
            model,
            steps: 3,
            initial,
            precision: positive(&mut random, active, 0.02),
            reading_weight: 0.8,
            error_scale: 0.2,
            directions: directions(VIRTUAL_READINGS, [0.445, 0.273]),
            center: center.map(|x| x + 4.0).collect(),
            rows: weights(&mut random, VIRTUAL_READINGS * components),
            row_scales: scales(&mut random, components, 0.8),
        });
        self
    }

    /// Contents of a small recipe.
    pub(crate) fn small(model: ModelKind, missing: MissingPolicy) -> Self {
        Self::new(model, SMALL, missing)
    }

    /// Contents of small recipes: each model with a descent and with Gauss-Newton steps, with and without a correction.
    pub(crate) fn all_small(missing: MissingPolicy) -> Vec<Self> {
        let plain = MODELS.map(|model| Self::small(model, missing));
        let corrected = plain.clone().map(|contents| contents.corrected(CORRECTED));
        let descents = plain.into_iter().chain(corrected);
        let with_steps = descents.flat_map(|contents| {
            let steps = contents
                .descent
                .is_some()
                .then(|| contents.clone().stepped());
            [contents].into_iter().chain(steps)
        });
        with_steps.collect()
    }

    pub(crate) fn model(&self) -> ModelKind {
        match (&self.descent, &self.gauss_newton) {
            (Some(descent_part), _) => descent_part.model,
            (_, Some(steps_part)) => steps_part.model,
            _ => ModelKind::Linear,
        }
    }

    /// The parameters before the offsets of the init net. Empty for Linear.
    pub(crate) fn initial(&self) -> &[f32] {
        match (&self.descent, &self.gauss_newton) {
            (Some(descent_part), _) => &descent_part.initial,
            (_, Some(steps_part)) => &steps_part.initial,
            _ => &[],
        }
    }

    /// The number of coefficients of a channel: m, or K with a correction.
    pub(crate) fn fitted_components(&self) -> usize {
        let correction = self.correction.as_ref();
        correction.map_or(self.components, |correction_part| {
            correction_part.precision.len()
        })
    }

    /// The number of hidden units, h.
    pub(crate) fn hidden(&self) -> usize {
        self.bias.len() - self.components
    }

    /// The recipe, by another writer than the crate's.
    pub(crate) fn write(&self) -> Vec<u8> {
        fn part<T: Serialize>(kind: Kind, part: &Option<T>) -> Option<(Kind, Vec<u8>)> {
            part.as_ref().map(|part| section(kind, part))
        }
        let prediction = self.prediction.as_deref().map(packed);
        let sections = [
            Some(section(Kind::PATTERN, &packed(&self.pattern))),
            part(Kind::DESCENT, &self.descent),
            Some(section(Kind::COMPLETION, self)),
            part(Kind::START, &self.init_net),
            part(Kind::GAUSS_NEWTON, &self.gauss_newton),
            part(Kind::CORRECTION, &self.correction),
            Some(expectation(0.03)),
            part(Kind::PREDICTION, &prediction),
            part(Kind::UNCERTAINTY, &self.uncertainty),
            part(Kind::PARTIAL, &self.partial),
        ];
        recipe_with(&sections.into_iter().flatten().collect::<Vec<_>>())
    }

    pub(crate) fn recipe(&self) -> Recipe<'static> {
        parsed(self.write())
    }
}
