//! The decoded sections of a body that a fit needs. Their numbers are not checked yet.

use super::decode::decode;
use super::error::RecipeError;
use super::kind::Kind;
use super::parts::{PackedMethod, PackedPartialLoss, PackedTarget};
use super::sections::Sections;
use crate::fit::{COMPLETION, RIDGE, Uncertainty};

/// The sections that a fit needs.
pub(super) struct Contents<'a> {
    pub(super) pattern: &'a [u8],
    pub(super) method: PackedMethod<'a>,
    pub(super) estimate: PackedEstimate<'a>,
}

/// The sections that estimate the loss of a completed fit.
#[derive(Clone, Copy, Default)]
pub(super) struct PackedEstimate<'a> {
    pub(super) prediction: Option<&'a [u8]>,
    pub(super) uncertainty: Option<Uncertainty>,
    pub(super) partial: Option<PackedPartialLoss<'a>>,
}

impl<'a> Contents<'a> {
    /// Decodes the sections of a body.
    pub(super) fn from_body(body: &'a [u8]) -> Result<Self, RecipeError> {
        let mut pattern = None;
        let mut descent = None;
        let mut ridge = None;
        let mut completion = None;
        let mut init_net = None;
        let mut gauss_newton = None;
        let mut correction = None;
        let mut estimate = PackedEstimate::default();
        let mut previous = None;
        let mut sections = Sections::new(body);
        for (kind, bytes) in &mut sections {
            // Strictly ascending, so no kind occurs twice.
            if previous >= Some(kind) {
                return Err(RecipeError::Order(kind));
            }
            previous = Some(kind);
            match kind {
                Kind::PATTERN => pattern = Some(decode(kind, bytes)?),
                Kind::DESCENT => descent = Some(decode(kind, bytes)?),
                Kind::RIDGE if RIDGE => ridge = Some(decode(kind, bytes)?),
                Kind::COMPLETION if COMPLETION => completion = Some(decode(kind, bytes)?),
                Kind::START if COMPLETION => init_net = Some(decode(kind, bytes)?),
                Kind::GAUSS_NEWTON if COMPLETION => gauss_newton = Some(decode(kind, bytes)?),
                Kind::CORRECTION if COMPLETION => correction = Some(decode(kind, bytes)?),
                // Optional, but a fit with a completion uses them.
                Kind::PREDICTION if COMPLETION => estimate.prediction = Some(decode(kind, bytes)?),
                Kind::UNCERTAINTY if COMPLETION => {
                    estimate.uncertainty = Some(decode(kind, bytes)?)
                }
                Kind::PARTIAL if COMPLETION => estimate.partial = Some(decode(kind, bytes)?),
                _ if kind.is_required() => return Err(RecipeError::Unknown(kind)),
                _ => {}
            }
        }
        if !sections.is_empty() {
            return Err(RecipeError::Malformed);
        }
        if correction.is_some() && completion.is_none() {
            return Err(RecipeError::Missing(Kind::COMPLETION));
        }
        Ok(Self {
            pattern: pattern.ok_or(RecipeError::Missing(Kind::PATTERN))?,
            method: match (descent, ridge, completion, (init_net, gauss_newton)) {
                (Some(descent), None, None, (None, None)) => PackedMethod::Descent(descent),
                (None, Some(ridge), None, (None, None)) => PackedMethod::Ridge(ridge),
                (None, None, Some(completion), (None, None)) => {
                    PackedMethod::Completed(completion, correction, PackedTarget::Linear)
                }
                (Some(descent), None, Some(completion), (Some(init_net), None)) => {
                    let target = PackedTarget::Descent(descent, init_net);
                    PackedMethod::Completed(completion, correction, target)
                }
                (None, None, Some(completion), (Some(init_net), Some(steps))) => {
                    let target = PackedTarget::GaussNewton(steps, init_net);
                    PackedMethod::Completed(completion, correction, target)
                }
                (None, None, None, (None, None)) => return Err(RecipeError::Learners(0)),
                // Neither is a method, so this is not a second method.
                (None, Some(_), None, (Some(_), _)) => {
                    return Err(RecipeError::Beside(Kind::START));
                }
                (None, Some(_), None, (None, Some(_))) => {
                    return Err(RecipeError::Beside(Kind::GAUSS_NEWTON));
                }
                (_, Some(_), _, _) | (Some(_), _, _, (_, Some(_))) => {
                    return Err(RecipeError::Learners(2));
                }
                (None, _, _, (Some(_), None)) => return Err(RecipeError::Missing(Kind::DESCENT)),
                (_, _, None, _) => return Err(RecipeError::Missing(Kind::COMPLETION)),
                (_, _, _, (None, _)) => return Err(RecipeError::Missing(Kind::START)),
            },
            estimate,
        })
    }
}
