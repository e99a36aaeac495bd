//! The loss that a fit is likely to have: what the formula says, for every model and whatever is
//! missing.

use glimpse_core::fit::completion::Missing;
use glimpse_core::fit::{AnyModel, Fitter, Linear};
use glimpse_core::model::{CookTorrance, ModelKind, Neural, Phong};
use glimpse_core::recipe::{Field, Kind, MAX_PREDICTION, PackedDescent, PackedLearner};
use glimpse_core::recipe::{Ingredients, Recipe, RecipeError};
use glimpse_core::scan::{Memory, Scan};

use super::made::{MODELS, Made, SAMPLES, WORDS};
use super::reference::{Readings, TOLERANCE, all, coefficients, entering};
use super::scans::read;

/// How far off, of itself: what coefficients are off, [`TOLERANCE`], times what they count for.
const ALLOWED: f64 = if TOLERANCE < 1e-5 { 2e-5 } else { TOLERANCE };
const PREDICTION: [f32; 5] = [-4.0, 0.3, -0.2, 0.5, 0.1];

fn made(model: ModelKind) -> Made {
    Made {
        prediction: Some(PREDICTION.to_vec()),
        ..Made::small(model, Missing::CountForMore)
    }
}

fn predicted<K: Fitter>(made: &Made, readings: &Readings, budget: u32) -> Option<f32> {
    let bytes = made.write().unwrap();
    let recipe = Recipe::parse(&bytes).unwrap();
    let mut memory = Memory::<K, SAMPLES>::new();
    let mut scan = Scan::new(recipe, &mut memory).unwrap();
    read(&mut scan, readings);
    let mut fit = scan.fit().unwrap();
    while !fit.advance(budget).is_complete() {}
    let found = fit.finish().unwrap().predicted_loss();
    // It is still there when the material is asked for once more.
    assert_eq!(scan.fitted().unwrap().predicted_loss(), found);
    found
}

fn by_name(made: &Made, readings: &Readings, budget: u32) -> Option<f32> {
    match made.then.as_ref().map(|(descends, _)| descends.model) {
        None | Some(ModelKind::Linear) => predicted::<Linear<WORDS>>(made, readings, budget),
        Some(ModelKind::Phong) => predicted::<Phong>(made, readings, budget),
        Some(ModelKind::CookTorrance) => predicted::<CookTorrance>(made, readings, budget),
        Some(ModelKind::Neural) => predicted::<Neural>(made, readings, budget),
    }
}

#[test]
fn it_is_what_the_formula_says() {
    for model in MODELS {
        let made = made(model);
        let mut some = all(SAMPLES);
        some[1] = None;
        some[4] = None;
        let mut found = Vec::new();
        for readings in [all(SAMPLES), some] {
            let bytes = made.write().unwrap();
            let recipe = Recipe::parse(&bytes).unwrap();
            let [red, green, blue] = coefficients(&made, &entering(&made, &recipe, &readings));
            let mut sum = f64::from(PREDICTION[0]);
            for (k, weight) in PREDICTION[1..].iter().enumerate() {
                sum += f64::from(*weight) * (red[k] + green[k] + blue[k]) / 3.0;
            }
            let expected = sum.exp();
            for budget in [1, 3, u32::MAX] {
                let loss = by_name(&made, &readings, budget).unwrap();
                let error = (f64::from(loss) - expected).abs();
                assert!(error < ALLOWED * expected, "{model}: {loss} and {expected}");
                let any = predicted::<AnyModel<WORDS>>(&made, &readings, budget);
                assert_eq!(any, Some(loss), "{model}");
            }
            found.push(expected);
        }
        assert!((found[0] - found[1]).abs() > 1e-3 * found[0], "{found:?}");
    }
}

#[test]
fn without_it_nothing_is_predicted() {
    for model in MODELS {
        let made = Made::small(model, Missing::CountForMore);
        assert_eq!(by_name(&made, &all(SAMPLES), 5), None);
    }
}

#[test]
fn one_that_is_too_large_for_a_number_is_none() {
    let mut made = made(ModelKind::Phong);
    made.prediction.as_mut().unwrap()[0] = 1e3;
    assert_eq!(by_name(&made, &all(SAMPLES), 5), None);
}

#[test]
fn one_that_makes_no_sense_is_refused() {
    let refused = |change: fn(&mut Vec<f32>)| {
        let mut made = made(ModelKind::Neural);
        change(made.prediction.as_mut().unwrap());
        made.write().unwrap_err()
    };
    let field = Field::Prediction;
    assert_eq!(refused(|list| list.truncate(4)), RecipeError::Count(field));
    assert_eq!(refused(|list| list.push(0.0)), RecipeError::Count(field));
    assert_eq!(refused(Vec::clear), RecipeError::Count(field));
    assert_eq!(
        refused(|list| list[2] = f32::NAN),
        RecipeError::NonFinite(field)
    );
    assert_eq!(
        refused(|list| list[2] = -2.0 * MAX_PREDICTION),
        RecipeError::Range(field)
    );
}

#[test]
fn without_a_completion_it_is_refused() {
    let ones = [0, 0, 0x80, 0x3F].repeat(7);
    let descent = PackedDescent {
        model: ModelKind::Phong,
        inner_steps: 1,
        initial: &ones,
        step_sizes: &ones,
    };
    let ingredients = Ingredients {
        prediction: Some(&[0; 4]),
        ..Ingredients::new(&[0; 12], PackedLearner::Descent(descent))
    };
    let error = Recipe::write(&ingredients, &mut [0; 256]).unwrap_err();
    assert_eq!(error, RecipeError::Missing(Kind::COMPLETION));
}

#[test]
fn a_copy_without_it_predicts_nothing() {
    let bytes = made(ModelKind::Phong).write().unwrap();
    let mut buffer = vec![0; bytes.len()];
    let recipe = Recipe::parse(&bytes).unwrap();
    let copy = recipe
        .copy_without(&[Kind::PREDICTION], &mut buffer)
        .unwrap();
    let copy = Recipe::parse(copy).unwrap();
    assert!(copy.completed().unwrap().prediction().is_empty());
    assert_eq!(recipe.completed().unwrap().prediction().len(), 5);
}
