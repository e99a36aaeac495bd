//! What a recipe states about itself, decoded when it is asked for: a fit needs none of it, so a
//! firmware that does not ask carries no code for it.

use super::check::{finite, not_negative};
use super::decode::decode;
use super::error::RecipeError;
use super::field::Field;
use super::kind::Kind;
use super::parts::{ExpectedLoss, Noise, Provenance};
use super::sections::{Materials, Sections};
use super::training::Training;
use crate::gonio::Limits;

/// What a recipe states about itself, by [`Recipe::metadata`](super::Recipe::metadata).
#[derive(Clone, Copy, Debug, Default)]
pub struct Metadata<'a> {
    /// The machine that the pattern was made for.
    pub limits: Option<Limits>,
    /// The noise that it was trained for.
    pub noise: Option<Noise>,
    /// The loss to expect on a material that training never saw, and on what that was found.
    pub expectation: Option<ExpectedLoss<'a>>,
    /// Where it came from.
    pub provenance: Option<Provenance<'a>>,
    /// The materials that it was trained on: names, and digests of their BRDFs. None where the
    /// recipe does not name them.
    pub materials: Materials<'a>,
    /// The training, in types.
    pub training: Option<Training<'a>>,
}

/// Decodes and checks the statements among these sections.
pub(super) fn read(sections: Sections<'_>) -> Result<Metadata<'_>, RecipeError> {
    let statements = decoded(sections)?;
    check(&statements)?;
    Ok(statements)
}

/// Decodes and checks the loss to expect, and nothing else: firmware that asks for it alone carries
/// no code for the other statements. None if there is none, or if it is invalid.
pub(super) fn expectation(mut sections: Sections<'_>) -> Option<ExpectedLoss<'_>> {
    let (kind, bytes) = sections.find(|(kind, _)| *kind == Kind::EXPECTATION)?;
    let expectation = decode(kind, bytes).ok()?;
    check_expectation(&expectation).ok()?;
    Some(expectation)
}

fn decoded(sections: Sections<'_>) -> Result<Metadata<'_>, RecipeError> {
    let mut statements = Metadata::default();
    for (kind, bytes) in sections {
        match kind {
            Kind::LIMITS => statements.limits = Some(decode(kind, bytes)?),
            Kind::NOISE => statements.noise = Some(decode(kind, bytes)?),
            Kind::EXPECTATION => statements.expectation = Some(decode(kind, bytes)?),
            Kind::PROVENANCE => statements.provenance = Some(decode(kind, bytes)?),
            Kind::MATERIALS => {
                statements.materials = Materials::new(bytes).ok_or(RecipeError::Section(kind))?;
            }
            Kind::TRAINING => {
                let training = Training::read(bytes).ok_or(RecipeError::Section(kind))?;
                statements.training = Some(training);
            }
            _ => {}
        }
    }
    Ok(statements)
}

fn check(statements: &Metadata<'_>) -> Result<(), RecipeError> {
    if let Some(limits) = &statements.limits {
        limits.validate().map_err(RecipeError::Limits)?;
    }
    if let Some(noise) = &statements.noise {
        not_negative(noise.multiplicative, Field::Multiplicative)?;
        not_negative(noise.additive, Field::Additive)?;
    }
    if let Some(expectation) = &statements.expectation {
        check_expectation(expectation)?;
    }
    if let Some(training) = &statements.training {
        for source in training.sources {
            not_negative(source.share, Field::Share)?;
        }
    }
    Ok(())
}

fn check_expectation(expectation: &ExpectedLoss<'_>) -> Result<(), RecipeError> {
    finite(expectation.loss, Field::ExpectedLoss)?;
    let standard_error = expectation.standard_error.unwrap_or(0.0);
    not_negative(standard_error, Field::StandardError)
}
