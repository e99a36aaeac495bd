//! What is in a recipe's sections.
//!
//! The order of fields and variants here is the format; see `core/docs/recipe.md`.

use serde::{Deserialize, Serialize};

use super::training::Training;
use crate::fit::{Descent, FitMethod, Target};
use crate::gonio::Limits;
use crate::model::ModelKind;

/// The parts of a recipe, for [`Recipe::write`](super::Recipe::write).
#[derive(Clone, Copy, Debug)]
pub struct RecipeParts<'a> {
    /// n x (theta_h, theta_d, phi_d), packed little-endian f32, radians.
    pub pattern: &'a [u8],
    /// The method that fits parameters to readings.
    pub method: PackedMethod<'a>,
    /// The machine that the pattern was made for.
    pub limits: Option<Limits>,
    /// The noise that it was trained for.
    pub noise: Option<Noise>,
    /// The loss to expect.
    pub expectation: Option<ExpectedLoss<'a>>,
    /// Where it came from.
    pub provenance: Option<Provenance<'a>>,
    /// Names and digests of the materials that it was trained on; none are no section.
    pub materials: &'a [(&'a str, u32)],
    /// From a completion's coefficients to the logarithm of the loss that a fit is likely to have,
    /// packed little-endian f32: a bias, and a weight for each component.
    pub prediction: Option<&'a [u8]>,
    /// The training, in types.
    pub training: Option<Training<'a>>,
}

impl<'a> RecipeParts<'a> {
    /// What every recipe needs, and nothing that is optional.
    #[must_use]
    pub const fn new(pattern: &'a [u8], method: PackedMethod<'a>) -> Self {
        Self {
            pattern,
            method,
            limits: None,
            noise: None,
            expectation: None,
            provenance: None,
            materials: &[],
            prediction: None,
            training: None,
        }
    }
}

/// How measurements become parameters, as bytes.
#[derive(Clone, Copy, Debug)]
pub enum PackedMethod<'a> {
    /// A few steps of SGD.
    Descent(PackedDescent<'a>),
    /// A ridge solve, the model Linear.
    Ridge(PackedRidge<'a>),
    /// A learned map: to the model Linear, or to where a descent starts.
    Completed(
        PackedCoefficientNet<'a>,
        Option<(PackedDescent<'a>, PackedInitNet<'a>)>,
    ),
}

/// A descent as bytes.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct PackedDescent<'a> {
    /// The model.
    pub model: ModelKind,
    /// SGD steps.
    pub inner_steps: u16,
    /// Initial parameters, packed little-endian f32.
    pub initial: &'a [u8],
    /// A step size for each parameter, packed little-endian f32.
    pub step_sizes: &'a [u8],
}

/// A ridge solve as bytes; all lists are packed little-endian f32.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct PackedRidge<'a> {
    /// m, the number of components.
    pub components: u16,
    /// The components at the sampled directions: n rows of m.
    pub basis: &'a [u8],
    /// The mean of the mapped training columns at the sampled directions, n.
    pub mean: &'a [u8],
    /// The median BRDF of the training columns there (not times a cosine), n.
    pub median: &'a [u8],
    /// cos(theta_i) cos(theta_o) there, n.
    pub weight: &'a [u8],
    /// The precision of each coefficient, m.
    pub precision: &'a [u8],
    /// The CRC-32 of the host's file of the whole basis, which turns coefficients into a BRDF; 0 if
    /// there is none.
    pub basis_checksum: u32,
}

/// A completion as bytes: weights are signed bytes, all other lists packed little-endian f32.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct PackedCoefficientNet<'a> {
    /// m, the number of coefficients of a channel.
    pub components: u16,
    /// What it was trained to do where readings are missing: the number of a
    /// [`Missing`](crate::fit::coefficient_net::MissingPolicy).
    pub missing: u8,
    /// What each sample's logarithm is centered by, n.
    pub center: &'a [u8],
    /// What it is multiplied by then.
    pub scale: f32,
    /// For each sample the weights own, mean and missing: n x 3 x (m + h).
    pub readings: &'a [u8],
    /// The scale of each row of `readings`, m + h.
    pub reading_scales: &'a [u8],
    /// The bias of each row, m + h.
    pub bias: &'a [u8],
    /// From hidden units to coefficients: m rows of h.
    pub output: &'a [u8],
    /// The scale of each row of `output`, m.
    pub output_scales: &'a [u8],
    /// The components at the sampled directions, n rows of m weights; empty where a descent follows.
    pub rows: &'a [u8],
    /// The scale of each component in `rows`, m; empty where a descent follows.
    pub row_scales: &'a [u8],
    /// The CRC-32 of the host's file of the whole basis, which turns coefficients into a BRDF; 0 if
    /// there is none.
    pub basis_checksum: u32,
}

/// Where a descent starts, as bytes: weights are signed bytes, all other lists packed little-endian
/// f32.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct PackedInitNet<'a> {
    /// From the coefficients of red, green and blue to units: g rows of 3 m.
    pub hidden: &'a [u8],
    /// The scale of each of those rows, g.
    pub hidden_scales: &'a [u8],
    /// The bias of each unit, g.
    pub bias: &'a [u8],
    /// From units to what is added to each initial parameter: rows of g.
    pub output: &'a [u8],
    /// The scale of each of those rows.
    pub output_scales: &'a [u8],
}

impl<'a> PackedDescent<'a> {
    fn of(descent: &Descent<'a>) -> Self {
        Self {
            model: descent.model(),
            inner_steps: descent.inner_steps(),
            initial: descent.initial().words().as_flattened(),
            step_sizes: descent.step_sizes().words().as_flattened(),
        }
    }
}

/// Without what predicts a completed fit's loss, which is a section of its own:
/// [`Completed::prediction`](crate::fit::Completed::prediction) goes into [`RecipeParts::prediction`].
impl<'a> From<FitMethod<'a>> for PackedMethod<'a> {
    fn from(method: FitMethod<'a>) -> Self {
        match method {
            FitMethod::Descent(descent) => Self::Descent(PackedDescent::of(&descent)),
            FitMethod::Completed(completed) => {
                let completion = completed.coefficient_net();
                let (rows, row_scales, then): (&[u8], &[u8], _) = match completed.target() {
                    Target::Linear(components) => {
                        let scales = components.scales().words().as_flattened();
                        (components.rows(), scales, None)
                    }
                    Target::Descent(descent, start) => {
                        let start = PackedInitNet {
                            hidden: start.hidden,
                            hidden_scales: start.hidden_scales.as_flattened(),
                            bias: start.bias.as_flattened(),
                            output: start.output,
                            output_scales: start.output_scales.as_flattened(),
                        };
                        (&[], &[], Some((PackedDescent::of(descent), start)))
                    }
                };
                let packed = PackedCoefficientNet {
                    // At most MAX_ROWS, which a u16 holds.
                    components: completion.components as u16,
                    missing: completed.missing() as u8,
                    center: completed.center().words().as_flattened(),
                    scale: completed.scale(),
                    readings: completion.readings,
                    reading_scales: completion.scales.as_flattened(),
                    bias: completion.bias.as_flattened(),
                    output: completion.output,
                    output_scales: completion.output_scales.as_flattened(),
                    rows,
                    row_scales,
                    basis_checksum: method.basis_checksum().unwrap_or_default(),
                };
                Self::Completed(packed, then)
            }
            FitMethod::Ridge(ridge) => Self::Ridge(PackedRidge {
                // At most MAX_COMPONENTS, which a u16 holds.
                components: ridge.components() as u16,
                basis: ridge.basis().words().as_flattened(),
                mean: ridge.mean().words().as_flattened(),
                median: ridge.median().words().as_flattened(),
                weight: ridge.weight().words().as_flattened(),
                precision: ridge.precision().words().as_flattened(),
                basis_checksum: ridge.basis_checksum().unwrap_or_default(),
            }),
        }
    }
}

/// The noise of readings that a recipe was trained for, on each channel by itself.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Noise {
    /// Standard deviation relative to the value, none negative.
    pub multiplicative: f32,
    /// Standard deviation besides, in sr^-1 (of the BRDF, not times the cosine), none negative.
    pub additive: f32,
    /// Levels that the sensor tells apart between darkness and a white surface (of BRDF 1/pi) that faces
    /// the light; 0 if quantization was left out of account.
    pub levels: u32,
}

/// The loss to expect on a material that training never saw.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExpectedLoss<'a> {
    /// The mean loss.
    pub loss: f32,
    /// The standard error of that mean, none negative. None where it is not known: of a single
    /// material, and in formats 1 and 2.
    pub standard_error: Option<f32>,
    /// How many materials that was found on; 0 where it is not known, as in formats 1 and 2.
    pub materials: u32,
    /// Which those were, in words; empty where it is not known, as in formats 1 and 2.
    pub on: &'a str,
}

/// Where a recipe came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Provenance<'a> {
    /// The program that trained it, with its version.
    pub trainer: &'a str,
    /// The materials it was trained on.
    pub data: &'a str,
    /// How many materials those were.
    pub materials: u32,
    /// Schedule and effort.
    pub schedule: &'a str,
    /// The seed of all random numbers.
    pub seed: u64,
    /// What else decided the outcome, in words; empty in formats 1 and 2.
    pub options: &'a str,
}
