//! What a body holds, each section decoded but none of its numbers looked at yet.

use serde::Deserialize;

use super::error::RecipeError;
use super::ingredients::{
    Expectation, Noise, PackedDescent, PackedLearner, PackedRidge, Provenance,
};
use super::kind::Kind;
use super::sections::{Materials, Sections};
use crate::gonio::Limits;

/// What every recipe holds.
pub(super) struct Contents<'a> {
    pub(super) pattern: &'a [u8],
    pub(super) learner: PackedLearner<'a>,
    pub(super) statements: Statements<'a>,
}

/// What a recipe may state about itself.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Statements<'a> {
    pub(super) limits: Option<Limits>,
    pub(super) noise: Option<Noise>,
    pub(super) expectation: Option<Expectation<'a>>,
    pub(super) provenance: Option<Provenance<'a>>,
    pub(super) materials: Materials<'a>,
}

impl<'a> Contents<'a> {
    /// Of a body of format 3.
    pub(super) fn of_sections(body: &'a [u8]) -> Result<Self, RecipeError> {
        let mut pattern = None;
        let mut descent: Option<PackedDescent<'a>> = None;
        let mut ridge: Option<PackedRidge<'a>> = None;
        let mut statements = Statements::default();
        let mut last = None;
        let mut sections = Sections::new(body);
        for (kind, bytes) in &mut sections {
            // Strictly ascending, so that no kind is there twice.
            if last >= Some(kind) {
                return Err(RecipeError::Order(kind));
            }
            last = Some(kind);
            match kind {
                Kind::PATTERN => pattern = decode(kind, bytes)?,
                Kind::DESCENT => descent = decode(kind, bytes)?,
                Kind::RIDGE => ridge = decode(kind, bytes)?,
                Kind::LIMITS => statements.limits = decode(kind, bytes)?,
                Kind::NOISE => statements.noise = decode(kind, bytes)?,
                Kind::EXPECTATION => statements.expectation = decode(kind, bytes)?,
                Kind::PROVENANCE => statements.provenance = decode(kind, bytes)?,
                Kind::MATERIALS => {
                    statements.materials =
                        Materials::new(bytes).ok_or(RecipeError::Section(kind))?;
                }
                _ if kind.is_required() => return Err(RecipeError::Unknown(kind)),
                _ => {}
            }
        }
        if !sections.is_empty() {
            return Err(RecipeError::Malformed);
        }
        Ok(Self {
            pattern: pattern.ok_or(RecipeError::Missing(Kind::PATTERN))?,
            learner: match (descent, ridge) {
                (Some(descent), None) => PackedLearner::Descent(descent),
                (None, Some(ridge)) => PackedLearner::Ridge(ridge),
                (None, None) => return Err(RecipeError::Learners(0)),
                (Some(_), Some(_)) => return Err(RecipeError::Learners(2)),
            },
            statements,
        })
    }
}

/// All of a section's bytes as one value.
fn decode<'a, T: Deserialize<'a>>(kind: Kind, bytes: &'a [u8]) -> Result<Option<T>, RecipeError> {
    match postcard::take_from_bytes(bytes) {
        Ok((value, [])) => Ok(Some(value)),
        _ => Err(RecipeError::Section(kind)),
    }
}
