//! What a recipe states about itself, decoded when it is asked for: a fit needs none of it, so a
//! firmware that does not ask carries no code for it.

use super::check::{finite, not_negative};
use super::decode::{Fields, decode};
use super::error::RecipeError;
use super::field::Field;
use super::ingredients::{Expectation, Noise, Provenance};
use super::kind::Kind;
use super::sections::{Materials, Sections};
use super::training::Training;
use crate::gonio::Limits;

/// What a recipe states about itself, by [`Recipe::statements`](super::Recipe::statements).
#[derive(Clone, Copy, Debug, Default)]
pub struct Statements<'a> {
    /// The machine that the pattern was made for.
    pub limits: Option<Limits>,
    /// The noise that it was trained for.
    pub noise: Option<Noise>,
    /// The loss to expect on a material that training never saw, and on what that was found.
    pub expectation: Option<Expectation<'a>>,
    /// Where it came from.
    pub provenance: Option<Provenance<'a>>,
    /// The materials that it was trained on: names, and digests of their BRDFs. None where the
    /// recipe does not name them.
    pub materials: Materials<'a>,
    /// The training, in types.
    pub training: Option<Training<'a>>,
}

/// Where the statements stand, not decoded yet.
#[derive(Clone, Copy, Debug)]
pub(super) enum Stated<'a> {
    /// Among the sections of format 3.
    Sections(Sections<'a>),
    /// At the end of a body of format 1 or 2.
    End(&'a [u8]),
}

impl<'a> Stated<'a> {
    /// Decodes and checks them.
    pub(super) fn read(self) -> Result<Statements<'a>, RecipeError> {
        let statements = match self {
            Self::Sections(sections) => of_sections(sections)?,
            Self::End(end) => of_end(end)?,
        };
        check(&statements)?;
        Ok(statements)
    }

    /// Decodes and checks the loss to expect, and nothing else: firmware that asks for it alone
    /// carries no code for the other statements. None if there is none, or it makes no sense.
    pub(super) fn expectation(self) -> Option<Expectation<'a>> {
        let expectation = match self {
            Self::Sections(mut sections) => {
                let (kind, bytes) = sections.find(|(kind, _)| *kind == Kind::EXPECTATION)?;
                decode(kind, bytes).ok()?
            }
            Self::End(end) => of_end(end).ok()?.expectation?,
        };
        check_expectation(&expectation).ok()?;
        Some(expectation)
    }
}

fn of_sections(sections: Sections<'_>) -> Result<Statements<'_>, RecipeError> {
    let mut statements = Statements::default();
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

/// What formats 1 and 2 end in: the loss to expect, and where the recipe came from.
fn of_end(end: &[u8]) -> Result<Statements<'_>, RecipeError> {
    let mut end = Fields(end);
    let loss = end.next()?;
    let provenance = Provenance {
        trainer: end.next()?,
        data: end.next()?,
        materials: end.next()?,
        schedule: end.next()?,
        seed: end.next()?,
        options: "",
    };
    if !end.0.is_empty() {
        return Err(RecipeError::Malformed);
    }
    Ok(Statements {
        expectation: Some(Expectation {
            loss,
            standard_error: None,
            materials: 0,
            on: "",
        }),
        provenance: Some(provenance),
        ..Statements::default()
    })
}

fn check(statements: &Statements<'_>) -> Result<(), RecipeError> {
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

fn check_expectation(expectation: &Expectation<'_>) -> Result<(), RecipeError> {
    finite(expectation.loss, Field::ExpectedLoss)?;
    let standard_error = expectation.standard_error.unwrap_or(0.0);
    not_negative(standard_error, Field::StandardError)
}
