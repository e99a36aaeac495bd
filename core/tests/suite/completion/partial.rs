//! The predicted loss, its bound, and the comparison with the training materials match their formulas, for every model.

use glimpse_core::fit::Uncertainty;
use glimpse_core::fit::coefficient_net::MissingPolicy;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{Kind, PackedDescent, PackedMethod, RecipeError, RecipeParts};
use glimpse_core::scan::{Reading, Scan};

use super::contents::{CompletedContents, PartialPart, SAMPLES};
use super::reference::{
    Readings, TOLERANCE, color, fitted_coefficients, innovation, some_readings,
};
use super::scans::Any;
use crate::recipes::{neural, packed, parsed, recipe_with, sections_of, write};
use crate::scanning::fit;

const PREDICTION: [f32; 5] = [-1.0, 0.03, -0.02, 0.05, 0.01];
const UNCERTAINTY: Uncertainty = Uncertainty {
    innovation: 0.7,
    residual: 0.4,
    bound: 2.5,
    max_innovation: 1.0,
};
const LOSS: [f32; SAMPLES] = [1.5, 0.75, 0.5, -0.25, 0.125, -0.5];
const BOUND: [f32; SAMPLES] = [9.0, 7.0, 0.5, 4.0, 3.0, 1.25];

/// Adds sections 133, 135 and 137 to a recipe of m = 4 components.
pub(crate) fn with_partial(contents: CompletedContents) -> CompletedContents {
    CompletedContents {
        prediction: Some(PREDICTION.to_vec()),
        uncertainty: Some(UNCERTAINTY),
        partial: Some(PartialPart {
            loss: LOSS.to_vec(),
            bound: BOUND.to_vec(),
        }),
        ..contents
    }
}

/// Small recipes of each model, with sections 133, 135 and 137.
pub(crate) fn all_small() -> impl Iterator<Item = CompletedContents> {
    let all = CompletedContents::all_small(MissingPolicy::Scaled);
    all.into_iter().map(with_partial)
}

/// The results of a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Estimate {
    mean_residual: f32,
    predicted_loss: Option<f32>,
    loss_bound: Option<f32>,
    is_unlike_training: Option<bool>,
}

/// The results of a fit of some samples. Others are saturated or missing.
fn estimate(contents: &CompletedContents, fitted: &[u16], saturated: &[u16]) -> Estimate {
    let recipe = contents.recipe();
    // A fit writes all the words that it reads.
    let mut memory = vec![f32::NAN; recipe.memory_words()];
    let mut scan = Scan::<Any>::new(recipe, &mut memory).unwrap();
    for index in fitted.iter().chain(saturated) {
        let reading = Reading {
            brdf: color(usize::from(*index)),
            saturated: saturated.contains(index),
        };
        scan.record(*index, reading).unwrap();
    }
    let mean_residual = fit(&mut scan, &[3, 7]).residual().mean;
    let fitted = scan.fitted().unwrap();
    Estimate {
        mean_residual,
        predicted_loss: fitted.predicted_loss(),
        loss_bound: fitted.loss_bound(),
        is_unlike_training: fitted.is_unlike_training(),
    }
}

/// The readings of some samples.
fn readings_of(fitted: &[u16]) -> Readings {
    some_readings(SAMPLES, |sample| fitted.contains(&(sample as u16)))
}

/// The predicted loss by `docs/recipe.md`, in f64.
fn expected_loss(contents: &CompletedContents, fitted: &[u16], mean_residual: f32) -> f64 {
    let (recipe, readings) = (contents.recipe(), readings_of(fitted));
    let [red, green, blue] = fitted_coefficients(contents, &recipe, &readings);
    let means = red.iter().zip(&green).zip(&blue);
    let means = means.map(|((red, green), blue)| (red + green + blue) / 3.0);
    let [bias, weights @ ..] = PREDICTION;
    let terms = weights.into_iter().zip(means);
    let mut exponent = f64::from(bias) + terms.map(|(q, a)| f64::from(q) * a).sum::<f64>();
    if contents.uncertainty.is_some() {
        exponent += 0.4 * (f64::from(mean_residual) + 1e-4).ln();
        if contents.correction.is_some() {
            exponent += 0.7 * (innovation(contents, &recipe, &readings) + 1e-3).ln();
        }
        if contents.partial.is_some() {
            exponent += f64::from(LOSS[fitted.len() - 1]);
        }
    }
    exponent.exp()
}

#[test]
fn loss_and_bound_match_formula_for_each_count() {
    let orders: [&[u16]; 2] = [&[0, 1, 2, 3, 4, 5], &[4, 1, 5, 0, 3, 2]];
    let all = all_small().flat_map(|contents| {
        let [mut without_partial, mut only_prediction] = [contents.clone(), contents.clone()];
        without_partial.partial = None;
        only_prediction.uncertainty = None;
        [contents, without_partial, only_prediction]
    });
    for contents in all {
        for (order, count) in orders
            .into_iter()
            .flat_map(|order| (1..=SAMPLES).map(move |count| (order, count)))
        {
            let (fitted, rest) = order.split_at(count);
            // A saturated reading does not count.
            for saturated in [&[][..], &rest[..rest.len().min(1)]] {
                let actual = estimate(&contents, fitted, saturated);
                let loss = f64::from(actual.predicted_loss.unwrap());
                let expected = expected_loss(&contents, fitted, actual.mean_residual);
                let error = (loss / expected - 1.0).abs();
                assert!(
                    error < 20.0 * TOLERANCE,
                    "{}, {count}: {error}",
                    contents.model()
                );
                let factor = match (&contents.uncertainty, &contents.partial) {
                    (None, _) => None,
                    (Some(uncertainty), None) => Some(uncertainty.bound),
                    (Some(_), Some(partial)) => Some(partial.bound[count - 1]),
                };
                let bound = factor.map(|factor| factor * loss as f32);
                assert_eq!(actual.loss_bound, bound);
            }
        }
    }
}

/// Each estimate needs the sections that it is made of. Only a recipe with all of them bounds the loss of some readings.
#[test]
fn estimates_need_their_sections() {
    let changes: [fn(&mut CompletedContents); 4] = [
        |contents| contents.prediction = None,
        |contents| contents.uncertainty = None,
        |contents| contents.partial = None,
        |contents| contents.missing = MissingPolicy::AllRequired as u8,
    ];
    for contents in all_small() {
        assert!(contents.recipe().bounds_partial_loss());
        for change in changes {
            let mut without = contents.clone();
            change(&mut without);
            assert!(!without.recipe().bounds_partial_loss());
            let actual = estimate(&without, &[0, 1, 2, 3, 4, 5], &[]);
            assert_eq!(
                actual.predicted_loss.is_some(),
                without.prediction.is_some()
            );
            let compared = without.uncertainty.is_some() && without.correction.is_some();
            assert_eq!(actual.is_unlike_training.is_some(), compared);
        }
    }
}

/// The comparison finds an innovation 5 % above that of the training materials, and not one 5 % below. The gradient of a
/// descent does not overwrite it.
#[test]
fn innovation_above_training_is_unlike() {
    let mut compared = 0;
    for mut contents in all_small().filter(|contents| contents.correction.is_some()) {
        for fitted in [&[0, 1, 2, 3, 4, 5][..], &[1, 3, 5], &[4]] {
            let innovation = innovation(&contents, &contents.recipe(), &readings_of(fitted));
            assert!(innovation > 0.1);
            for (factor, expected) in [(0.95, true), (1.05, false)] {
                let uncertainty = contents.uncertainty.as_mut().unwrap();
                uncertainty.max_innovation = (factor * innovation) as f32;
                let is_unlike = estimate(&contents, fitted, &[]).is_unlike_training;
                assert_eq!(is_unlike, Some(expected), "{}", contents.model());
                compared += 1;
            }
        }
    }
    // Four models, and three of them also with Gauss-Newton steps.
    assert_eq!(compared, (4 + 3) * 3 * 2);
}

/// A loss or a bound that overflows is unknown.
#[test]
fn infinite_estimate_is_none() {
    for mut contents in all_small() {
        contents.partial = Some(PartialPart {
            loss: vec![0.0, 80.0, 0.0, 0.0, 0.0, 0.0],
            bound: vec![f32::MAX; SAMPLES],
        });
        let actual = estimate(&contents, &[1, 4], &[]);
        assert!(actual.predicted_loss.unwrap() > 1.0);
        assert_eq!(actual.loss_bound, None);
        contents.prediction.as_mut().unwrap()[0] = 1e3;
        assert_eq!(estimate(&contents, &[1, 4], &[]).predicted_loss, None);
    }
}

#[test]
fn rejects_prediction_without_completion() {
    let ones = packed(&[1.0; 7]);
    let descent = PackedDescent {
        model: ModelKind::Phong,
        inner_steps: 1,
        initial: &ones,
        step_sizes: &ones,
    };
    let parts = RecipeParts {
        prediction: Some(&[0; 4]),
        ..RecipeParts::new(&[0; 12], PackedMethod::Descent(descent))
    };
    let error = RecipeError::Missing(Kind::COMPLETION);
    assert_eq!(write(&parts), Err(error));
}

/// A section without a completion is ignored.
#[test]
fn section_has_no_effect_on_descent() {
    let mut sections = sections_of(&neural().write().unwrap());
    let completed = sections_of(&all_small().next().unwrap().write());
    sections.extend(
        completed
            .into_iter()
            .filter(|(kind, _)| *kind == Kind::PARTIAL),
    );
    let recipe = parsed(recipe_with(&sections));
    assert!(recipe.descent().is_some() && !recipe.bounds_partial_loss());
}
