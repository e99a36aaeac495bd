//! The metadata of a recipe, decoded on request.
//!
//! A fit needs none of it. Firmware that does not request it contains no code for it.

use super::check::not_negative;
use super::decode::decode;
use super::error::RecipeError;
use super::field::Field;
use super::kind::Kind;
use super::parts::{ExpectedLoss, Noise, Provenance, ScanTime};
use super::sections::{Materials, Sections};
use super::training::Training;
use crate::gonio::{Limits, UncheckedLimits};

/// The metadata of a recipe, returned by [`Recipe::metadata`](super::Recipe::metadata).
#[derive(Clone, Copy, Debug, Default)]
pub struct Metadata<'a> {
    /// The limits of the machine that the pattern was trained for.
    pub limits: Option<Limits>,
    /// The noise of the readings in training.
    pub noise: Option<Noise>,
    /// The expected loss on a material that was not in the training data, and the materials of this estimate.
    pub expectation: Option<ExpectedLoss<'a>>,
    /// The provenance of the recipe.
    pub provenance: Option<Provenance<'a>>,
    /// Names of the training materials, and digests of their BRDFs. Empty if the recipe does not name them.
    pub materials: Materials<'a>,
    /// The settings of the training, for programs.
    pub training: Option<Training<'a>>,
    /// The time of a scan that the pattern was trained for.
    pub scan_time: Option<ScanTime>,
}

/// Decodes and checks the metadata among these sections.
pub(super) fn read(sections: Sections<'_>) -> Result<Metadata<'_>, RecipeError> {
    let metadata = decode_all(sections)?;
    check(&metadata)?;
    Ok(metadata)
}

/// Decodes and checks only the expected loss. None if it is absent or invalid.
///
/// Firmware that requests only this contains no code for other metadata.
pub(super) fn read_expectation(mut sections: Sections<'_>) -> Option<ExpectedLoss<'_>> {
    let (kind, bytes) = sections.find(|(kind, _)| *kind == Kind::EXPECTATION)?;
    let expectation = decode(kind, bytes).ok()?;
    check_expectation(&expectation).ok()?;
    Some(expectation)
}

fn decode_all(sections: Sections<'_>) -> Result<Metadata<'_>, RecipeError> {
    let mut metadata = Metadata::default();
    for (kind, bytes) in sections {
        match kind {
            Kind::LIMITS => {
                let limits: UncheckedLimits = decode(kind, bytes)?;
                metadata.limits = Some(limits.try_into().map_err(RecipeError::Limits)?);
            }
            Kind::SCAN_TIME => metadata.scan_time = Some(decode(kind, bytes)?),
            Kind::NOISE => metadata.noise = Some(decode(kind, bytes)?),
            Kind::EXPECTATION => metadata.expectation = Some(decode(kind, bytes)?),
            Kind::PROVENANCE => metadata.provenance = Some(decode(kind, bytes)?),
            Kind::MATERIALS => {
                metadata.materials = Materials::new(bytes).ok_or(RecipeError::Section(kind))?;
            }
            Kind::TRAINING => {
                let training = Training::read(bytes).ok_or(RecipeError::Section(kind))?;
                metadata.training = Some(training);
            }
            _ => {}
        }
    }
    Ok(metadata)
}

fn check(metadata: &Metadata<'_>) -> Result<(), RecipeError> {
    if let Some(noise) = &metadata.noise {
        not_negative(noise.multiplicative, Field::Multiplicative)?;
        not_negative(noise.additive, Field::Additive)?;
    }
    if let Some(ScanTime {
        speeds,
        settle,
        seconds,
    }) = &metadata.scan_time
    {
        for speed in [speeds.theta_i, speeds.phi_i, speeds.theta_o, speeds.phi_o] {
            not_negative(speed, Field::Speed)?;
        }
        not_negative(*settle, Field::Settle)?;
        not_negative(*seconds, Field::Seconds)?;
    }
    if let Some(expectation) = &metadata.expectation {
        check_expectation(expectation)?;
    }
    if let Some(training) = &metadata.training {
        for source in training.sources {
            not_negative(source.share, Field::Share)?;
        }
    }
    Ok(())
}

fn check_expectation(expectation: &ExpectedLoss<'_>) -> Result<(), RecipeError> {
    not_negative(expectation.loss, Field::ExpectedLoss)?;
    let standard_error = expectation.standard_error.unwrap_or(0.0);
    not_negative(standard_error, Field::StandardError)
}
