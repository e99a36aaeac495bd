//! The predicted loss of a fit matches its formula, for every model, with and without missing readings.

use glimpse_core::fit::coefficient_net::MissingPolicy;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{Kind, PackedDescent, PackedMethod, Recipe, RecipeError, RecipeParts};
use glimpse_core::scan::Scan;

use super::contents::{CompletedContents, SAMPLES};
use super::reference::{Readings, TOLERANCE, all_readings, fitted_coefficients, some_readings};
use super::scans::{Any, record_readings};
use crate::recipes::{packed, write};

/// The largest relative error: that of the coefficients, [`TOLERANCE`], times their weights.
const MAX_RELATIVE_ERROR: f64 = if TOLERANCE < 1e-5 { 2e-5 } else { TOLERANCE };
const PREDICTION: [f32; 5] = [-4.0, 0.3, -0.2, 0.5, 0.1];

fn contents(model: ModelKind) -> CompletedContents {
    CompletedContents {
        prediction: Some(PREDICTION.to_vec()),
        ..CompletedContents::small(model, MissingPolicy::Scaled)
    }
}

fn predicted(contents: &CompletedContents, readings: &Readings, budget: u32) -> Option<f32> {
    let recipe = contents.recipe();
    let mut memory = vec![0.0; recipe.memory_words()];
    let mut scan = Scan::<Any>::new(recipe, &mut memory).unwrap();
    record_readings(&mut scan, readings);
    let mut fit = scan.fit().unwrap();
    while !fit.advance(budget).is_complete() {}
    let _ = fit.finish(); // may be implausible
    scan.fitted().unwrap().predicted_loss()
}

#[test]
fn prediction_matches_formula() {
    for contents in CompletedContents::all_small(MissingPolicy::Scaled) {
        let model = contents.model();
        let contents = CompletedContents {
            prediction: Some(PREDICTION.to_vec()),
            ..contents
        };
        let readings = [
            all_readings(SAMPLES),
            some_readings(SAMPLES, |k| k != 1 && k != 4),
        ];
        let [with_all, with_some] = readings.map(|readings| {
            let [red, green, blue] = fitted_coefficients(&contents, &contents.recipe(), &readings);
            let mut sum = f64::from(PREDICTION[0]);
            for (k, weight) in PREDICTION[1..].iter().enumerate() {
                sum += f64::from(*weight) * (red[k] + green[k] + blue[k]) / 3.0;
            }
            let expected = sum.exp();
            for budget in [1, 3, u32::MAX] {
                let loss = predicted(&contents, &readings, budget).unwrap();
                let error = (f64::from(loss) - expected).abs();
                assert!(
                    error < MAX_RELATIVE_ERROR * expected,
                    "{model}: {loss} and {expected}"
                );
            }
            expected
        });
        assert!((with_all - with_some).abs() > 1e-3 * with_all);
    }
}

#[test]
fn no_prediction_without_section() {
    for contents in CompletedContents::all_small(MissingPolicy::Scaled) {
        assert_eq!(predicted(&contents, &all_readings(SAMPLES), 5), None);
    }
}

#[test]
fn infinite_prediction_is_none() {
    let mut contents = contents(ModelKind::Phong);
    contents.prediction.as_mut().unwrap()[0] = 1e3;
    assert_eq!(predicted(&contents, &all_readings(SAMPLES), 5), None);
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

#[test]
fn copy_without_section_predicts_nothing() {
    let recipe = contents(ModelKind::Phong).recipe();
    let mut buffer = vec![0; 1 << 17];
    let copy = recipe.copy_without(&[Kind::PREDICTION], &mut buffer);
    let copy = Recipe::parse(copy.unwrap()).unwrap();
    assert!(copy.completed().unwrap().prediction().is_empty());
    assert_eq!(recipe.completed().unwrap().prediction().len(), 5);
}
