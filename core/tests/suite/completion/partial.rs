//! The predicted loss and its bound depend on the number of readings that count in the fit.

use glimpse_core::fit::Uncertainty;
use glimpse_core::fit::coefficient_net::MissingPolicy;
use glimpse_core::recipe::{Kind, Recipe};
use glimpse_core::scan::{Reading, Scan};

use super::contents::{CompletedContents, PartialPart, SAMPLES};
use super::reference::{
    Readings, TOLERANCE, color, fitted_coefficients, innovation, some_readings,
};
use super::scans::Any;
use crate::recipes::{packed, parsed, recipe_with, sections_of};
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

fn partial_part() -> PartialPart {
    PartialPart {
        loss: LOSS.to_vec(),
        bound: BOUND.to_vec(),
    }
}

/// Adds sections 133, 135 and 137 to a recipe of m = 4 components.
pub(crate) fn with_partial(contents: CompletedContents) -> CompletedContents {
    CompletedContents {
        prediction: Some(PREDICTION.to_vec()),
        uncertainty: Some(UNCERTAINTY),
        partial: Some(partial_part()),
        ..contents
    }
}

/// Small recipes of each model, with sections 133, 135 and 137.
pub(crate) fn all_small() -> impl Iterator<Item = CompletedContents> {
    let all = CompletedContents::all_small(MissingPolicy::Scaled);
    all.into_iter().map(with_partial)
}

/// The mean residual, the predicted loss and its bound after a fit of some samples. Others are saturated or missing.
fn estimate(
    contents: &CompletedContents,
    fitted: &[u16],
    saturated: &[u16],
) -> (f32, Option<f32>, Option<f32>) {
    let recipe = contents.recipe();
    let mut memory = vec![f32::NAN; recipe.memory_words()];
    let mut scan = Scan::<Any>::new(recipe, &mut memory).unwrap();
    for index in fitted.iter().chain(saturated) {
        let reading = Reading {
            brdf: color(usize::from(*index)),
            saturated: saturated.contains(index),
        };
        scan.record(*index, reading).unwrap();
    }
    let residual = fit(&mut scan, &[3, 7]).residual();
    let fitted = scan.fitted().unwrap();
    (residual.mean, fitted.predicted_loss(), fitted.loss_bound())
}

/// The predicted loss by `docs/recipe.md`, in f64.
fn expected_loss(contents: &CompletedContents, readings: &Readings, mean_residual: f32) -> f64 {
    let recipe = contents.recipe();
    let [red, green, blue] = fitted_coefficients(contents, &recipe, readings);
    let means = red.iter().zip(&green).zip(&blue);
    let means = means.map(|((red, green), blue)| (red + green + blue) / 3.0);
    let [bias, weights @ ..] = PREDICTION;
    let terms = weights.into_iter().zip(means);
    let mut exponent = f64::from(bias) + terms.map(|(q, a)| f64::from(q) * a).sum::<f64>();
    exponent += 0.4 * (f64::from(mean_residual) + 1e-4).ln();
    if contents.correction.is_some() {
        exponent += 0.7 * (innovation(contents, &recipe, readings) + 1e-3).ln();
    }
    let count = readings.iter().flatten().count();
    exponent += f64::from(LOSS[count - 1]);
    exponent.exp()
}

#[test]
fn loss_and_bound_match_formula_for_each_count() {
    let orders: [&[u16]; 2] = [&[0, 1, 2, 3, 4, 5], &[4, 1, 5, 0, 3, 2]];
    for contents in all_small() {
        for order in orders {
            for count in 1..=SAMPLES {
                let (fitted, rest) = order.split_at(count);
                // A saturated reading does not count.
                for saturated in [&[][..], &rest[..rest.len().min(1)]] {
                    let (residual, loss, bound) = estimate(&contents, fitted, saturated);
                    let is_fitted = |sample: usize| fitted.contains(&(sample as u16));
                    let readings = some_readings(SAMPLES, is_fitted);
                    let expected = expected_loss(&contents, &readings, residual);
                    let name = contents.model();
                    for (actual, expected) in [
                        (loss.unwrap(), expected),
                        (bound.unwrap(), expected * f64::from(BOUND[count - 1])),
                    ] {
                        let error = (f64::from(actual) / expected - 1.0).abs();
                        assert!(error < 20.0 * TOLERANCE, "{name}, {count}: {error}");
                    }
                }
            }
        }
    }
}

/// With factor 1 and the bound of section 135, the section has no effect, to the bit.
#[test]
fn neutral_section_changes_nothing() {
    for mut contents in all_small() {
        contents.partial = Some(PartialPart {
            loss: vec![0.0; SAMPLES],
            bound: vec![UNCERTAINTY.bound; SAMPLES],
        });
        let mut without = contents.clone();
        without.partial = None;
        for fitted in [&[2][..], &[0, 5, 1], &[0, 1, 2, 3, 4, 5]] {
            let expected = estimate(&without, fitted, &[]);
            assert!(expected.2.is_some());
            assert_eq!(estimate(&contents, fitted, &[]), expected);
        }
    }
}

#[test]
fn no_effect_without_other_sections() {
    for contents in all_small() {
        let mut bare = contents.clone();
        (bare.uncertainty, bare.partial) = (None, None);
        let mut without = contents.clone();
        without.uncertainty = None;
        let (_, loss, bound) = estimate(&without, &[0, 1], &[]);
        assert!(loss.is_some() && bound.is_none());
        assert_eq!((loss, bound), {
            let (_, loss, bound) = estimate(&bare, &[0, 1], &[]);
            (loss, bound)
        });
        assert!(contents.recipe().bounds_partial_loss());
        assert!(!without.recipe().bounds_partial_loss());
        let mut without = contents.clone();
        without.prediction = None;
        let (_, loss, bound) = estimate(&without, &[0, 1], &[]);
        assert_eq!((loss, bound), (None, None));
        assert!(!without.recipe().bounds_partial_loss());
        let mut without = contents.clone();
        without.partial = None;
        assert!(!without.recipe().bounds_partial_loss());
        let mut without = contents;
        without.missing = MissingPolicy::AllRequired as u8;
        assert!(!without.recipe().bounds_partial_loss());
    }
}

#[test]
fn section_round_trip() {
    for contents in all_small() {
        let bytes = contents.write();
        let recipe = Recipe::parse(&bytes).unwrap();
        let partial = recipe.completed().unwrap().partial().unwrap();
        assert!(partial.loss().iter().eq(LOSS));
        assert!(partial.bound().iter().eq(BOUND));
        let (kind, section) = recipe.sections().last().unwrap();
        assert_eq!(
            (kind, kind.number(), kind.is_required()),
            (Kind::PARTIAL, 137, false)
        );
        let length = [4 * SAMPLES as u8];
        let expected = [&length[..], &packed(&LOSS), &length, &packed(&BOUND)];
        assert_eq!(section, expected.concat());
        // Read in place.
        assert!(
            bytes
                .as_ptr_range()
                .contains(&partial.bound().words().as_ptr().cast())
        );

        let mut buffer = vec![0; bytes.len()];
        let copy = recipe.copy_without(&[Kind::PARTIAL], &mut buffer).unwrap();
        let copy = Recipe::parse(copy).unwrap();
        assert!(copy.completed().unwrap().partial().is_none());
        assert!(copy.completed().unwrap().uncertainty().is_some());
    }
}

/// A bound that overflows is unknown, although the loss is known.
#[test]
fn infinite_bound_is_none() {
    for mut contents in all_small() {
        contents.partial = Some(PartialPart {
            loss: vec![0.0, 80.0, 0.0, 0.0, 0.0, 0.0],
            bound: vec![f32::MAX; SAMPLES],
        });
        let (_, loss, bound) = estimate(&contents, &[1, 4], &[]);
        assert!(loss.unwrap() > 1.0);
        assert_eq!(bound, None);
    }
}

/// A section without a completion is ignored.
#[test]
fn section_has_no_effect_on_descent() {
    let mut sections = sections_of(&crate::recipes::neural().write().unwrap());
    let completed = sections_of(&all_small().next().unwrap().write());
    sections.extend(
        completed
            .into_iter()
            .filter(|(kind, _)| *kind == Kind::PARTIAL),
    );
    let recipe = parsed(recipe_with(&sections));
    assert!(recipe.descent().is_some() && !recipe.bounds_partial_loss());
}
