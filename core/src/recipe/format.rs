//! What is in a recipe's bytes: its body in each version.
//!
//! The order of fields and variants here is the format; see the head of `recipe.rs`.

use serde::{Deserialize, Serialize};

use crate::model::ModelKind;

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
}

/// The ingredients of a recipe, for [`Recipe::write`](super::Recipe::write): the body, version 2.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Ingredients<'a> {
    /// n x (theta_h, theta_d, phi_d), packed little-endian f32, radians.
    pub pattern: &'a [u8],
    /// How measurements become parameters.
    #[serde(borrow)]
    pub learner: PackedLearner<'a>,
    /// The loss to expect on a material that training never saw.
    pub expected_loss: f32,
    /// Where it came from.
    #[serde(borrow)]
    pub provenance: Provenance<'a>,
}

/// How measurements become parameters, as bytes.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub enum PackedLearner<'a> {
    /// A few steps of SGD.
    #[serde(borrow)]
    Descent(PackedDescent<'a>),
    /// A ridge solve, the model Linear.
    #[serde(borrow)]
    Ridge(PackedRidge<'a>),
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

/// The body, version 1.
#[derive(Deserialize)]
pub(super) struct FirstBody<'a> {
    model: ModelKind,
    inner_steps: u16,
    pattern: &'a [u8],
    initial: &'a [u8],
    step_sizes: &'a [u8],
    expected_loss: f32,
    #[serde(borrow)]
    provenance: Provenance<'a>,
}

impl<'a> From<FirstBody<'a>> for Ingredients<'a> {
    fn from(body: FirstBody<'a>) -> Self {
        Self {
            pattern: body.pattern,
            learner: PackedLearner::Descent(PackedDescent {
                model: body.model,
                inner_steps: body.inner_steps,
                initial: body.initial,
                step_sizes: body.step_sizes,
            }),
            expected_loss: body.expected_loss,
            provenance: body.provenance,
        }
    }
}
