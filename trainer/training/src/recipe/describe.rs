//! The recipe of a training run: what was learned, and where it came from.

use glimpse_core::gonio::Limits;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{
    ExpectedLoss, Noise, Provenance, RecipeError, RecipeParts, Training, TrainingSources,
    ValidationSplit,
};

use super::file::RecipeFile;
use super::pack::{packed, packed_fit, packed_pattern};
use crate::linear::Prior;
use crate::meta::learned::{Learned, ValidatedLoss};
use crate::meta::options::{Options, Parts};
use crate::meta::plan::Schedule;

/// What was learned cannot be written down.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("training did not converge to a recipe")]
pub struct DescribeError(#[from] RecipeError);

/// Writes down what was learned, with where it came from: `data` is what the materials are called.
///
/// # Errors
/// If it is no recipe, as when a number is not finite.
pub fn recipe_of(
    learned: &Learned,
    options: &Options,
    data: &str,
) -> Result<RecipeFile, DescribeError> {
    let schedule = schedule_of(options);
    let ValidatedLoss { expected, split } = learned.expected_loss;
    let on = format!("materials of {data} {}", split_in_words(split));
    let sources = options.sources();
    let materials: Vec<(&str, u32)> = learned
        .materials
        .iter()
        .map(|material| (&material.name[..], material.digest))
        .collect();
    let completion_options = &options.completion_options;
    let completes = options.schedule == Schedule::Prior;
    let prediction = learned
        .prediction
        .as_ref()
        .map(|each| packed(&each.weights));
    let pattern = packed_pattern(&learned.pattern);
    let file = packed_fit(&learned.fit, |fit| {
        RecipeFile::write(&RecipeParts {
            limits: Some(completion_options.limits)
                .filter(|limits| completes && *limits != Limits::NONE),
            noise: Some(completion_options.noise()).filter(|noise| completes && !is_none(noise)),
            expectation: Some(ExpectedLoss {
                loss: expected.loss,
                standard_error: expected.standard_error,
                materials: expected.materials as u32,
                on: &on,
            }),
            provenance: Some(provenance(options, data, materials.len(), &schedule)),
            materials: &materials,
            prediction: prediction.as_deref(),
            training: Some(Training {
                schedule: options.schedule.into(),
                effort: options.effort.into(),
                parts: options.parts.stated(),
                split,
                digest: options.digest(),
                sources: TrainingSources::new(&sources),
            }),
            ..RecipeParts::new(&pattern, fit)
        })
    });
    Ok(file?)
}

fn is_none(noise: &Noise) -> bool {
    noise.multiplicative + noise.additive == 0.0 && noise.levels == 0
}

/// Returns words for the materials that a loss was found on; they follow "materials of" and a source.
#[must_use]
pub fn split_in_words(split: ValidationSplit) -> &'static str {
    match split {
        ValidationSplit::HeldOut => "held out of training",
        ValidationSplit::Training => "that it was trained on",
        ValidationSplit::LeftOut => "that it was trained on, each with a basis of others",
        ValidationSplit::Folds => "that it was trained on, each by what was trained without it",
        other => other.name(),
    }
}

/// The provenance of a recipe that is trained with these options.
fn provenance<'a>(
    options: &Options,
    data: &'a str,
    materials: usize,
    schedule: &'a str,
) -> Provenance<'a> {
    Provenance {
        trainer: concat!("glimpse-trainer ", env!("CARGO_PKG_VERSION")),
        data,
        materials: materials as u32,
        schedule,
        seed: options.seed,
        options: match options.parts {
            Parts::All => "all parts",
            Parts::AllTwice => "all parts twice",
            Parts::WithoutPattern => "start and step sizes only",
            Parts::PatternOnly(_) => "pattern only",
        },
    }
}

/// A schedule in words, with the prior of Linear.
fn schedule_of(options: &Options) -> String {
    let schedule = format!("{:?} {:?}", options.schedule, options.effort).to_lowercase();
    if options.schedule == Schedule::Prior {
        return format!("{schedule}, {}", options.completion_options);
    }
    match (options.model, options.prior) {
        (ModelKind::Linear, Prior { components, eta }) => {
            let eta = eta.map_or("learned".to_owned(), |eta| eta.to_string());
            format!("{schedule}, {components} bases, eta {eta}")
        }
        _ => schedule,
    }
}

/// Describes a training with these options to people.
#[must_use]
pub fn describe_options(options: &Options, data: &str) -> String {
    let materials = options.portions.iter().map(|each| each.materials).sum();
    let schedule = schedule_of(options);
    let provenance = provenance(options, data, materials, &schedule);
    let (model, samples) = (options.model, options.samples);
    describe_training(model, samples, &provenance, options.digest())
}

/// Describes a recipe's training to people.
#[must_use]
pub fn describe_training(
    model: ModelKind,
    samples: usize,
    provenance: &Provenance<'_>,
    digest: u64,
) -> String {
    let Provenance {
        data,
        materials,
        schedule,
        seed,
        ..
    } = provenance;
    format!(
        "{model} n = {samples}, {materials} materials of {data}, {schedule}, seed {seed}, digest \
         {digest:016x}"
    )
}
