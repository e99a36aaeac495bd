//! The recipe of a training run: the learned fit and its provenance.

use glimpse_core::gonio::Limits;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{
    ExpectedLoss, Noise, PackedPartialLoss, Provenance, RecipeError, RecipeParts, Training,
    TrainingSources, ValidationSplit,
};

use super::file::RecipeFile;
use super::pack::{pack_fit, pack_pattern, pack_values};
use crate::linear::Prior;
use crate::meta::learned::{LearnedRecipe, ValidatedLoss};
use crate::meta::options::{Options, TrainedParts};
use crate::meta::plan::Schedule;

/// The training result is not a valid recipe.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "training did not converge to a valid recipe; train with another seed or with more materials"
)]
pub struct PackError(#[from] RecipeError);

/// Packs a training result and its provenance as a recipe. `data` is the name of the training materials.
///
/// # Errors
/// Fails if the result is not a valid recipe, for example if a number is not finite.
pub fn pack_recipe(
    learned: &LearnedRecipe,
    options: &Options,
    data: &str,
) -> Result<RecipeFile, PackError> {
    let schedule = schedule_of(options);
    let ValidatedLoss { estimate, split } = learned.expected_loss;
    let validation_materials = format!("materials of {data} {}", describe_split(split));
    let sources = options.sources();
    let materials: Vec<(&str, u32)> = learned
        .materials
        .iter()
        .map(|material| (&material.name[..], material.digest))
        .collect();
    let completion_options = &options.completion_options;
    let is_completed = options.schedule == Schedule::Prior;
    let prediction = learned
        .loss_predictor
        .as_ref()
        .map(|each| pack_values(&each.weights));
    let partial = learned.loss_predictor.as_ref();
    let partial = partial.and_then(|each| each.partial.as_ref());
    let partial = partial.map(|each| [&each.loss, &each.bound].map(|list| pack_values(list)));
    let pattern = pack_pattern(&learned.pattern);
    let file = pack_fit(&learned.fit, |fit| {
        RecipeFile::write(&RecipeParts {
            limits: Some(completion_options.limits)
                .filter(|limits| is_completed && *limits != Limits::NONE),
            noise: Some(completion_options.noise()).filter(|noise| is_completed && !is_none(noise)),
            expectation: Some(ExpectedLoss {
                loss: estimate.loss,
                standard_error: estimate.standard_error,
                materials: estimate.materials as u32,
                on: &validation_materials,
            }),
            provenance: Some(provenance(options, data, materials.len(), &schedule)),
            materials: &materials,
            prediction: prediction.as_deref(),
            partial: partial
                .as_ref()
                .map(|[loss, bound]| PackedPartialLoss { loss, bound }),
            scan_time: completion_options
                .scan
                .filter(|_| is_completed)
                .map(|scan| scan.to_recipe()),
            uncertainty: learned.loss_predictor.as_ref().map(|each| each.uncertainty),
            training: Some(Training {
                schedule: options.schedule.into(),
                effort: options.effort.into(),
                parts: options.parts.to_recipe(),
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

/// Describes the materials of a validation loss in words that follow "materials of" and a source.
#[must_use]
pub fn describe_split(split: ValidationSplit) -> &'static str {
    match split {
        ValidationSplit::HeldOut => "held out of training",
        ValidationSplit::Training => "that it was trained on",
        ValidationSplit::LeftOut => "that it was trained on, each with a basis of others",
        ValidationSplit::Folds => "that it was trained on, each by what was trained without it",
        other => other.name(),
    }
}

/// Returns the provenance of a recipe that is trained with these options.
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
            TrainedParts::All => "all parts",
            TrainedParts::AllTwice => "all parts twice",
            TrainedParts::WithoutPattern => "start and step sizes only",
            TrainedParts::PatternOnly(_) => "pattern only",
        },
    }
}

/// Describes a schedule in words, including the prior of the model Linear.
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

/// Describes a training with these options in one line of text.
#[must_use]
pub fn describe_options(options: &Options, data: &str) -> String {
    let materials = options
        .source_shares
        .iter()
        .map(|each| each.materials)
        .sum();
    let schedule = schedule_of(options);
    let provenance = provenance(options, data, materials, &schedule);
    let (model, samples) = (options.model, options.samples);
    describe_training(model, samples, &provenance, options.digest())
}

/// Describes the training of a recipe in one line of text.
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
