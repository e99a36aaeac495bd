//! The predicted loss and the comparison with the training materials depend on the innovation and the residual, for every
//! model, with and without missing readings.

use glimpse_core::fit::Uncertainty;
use glimpse_core::fit::coefficient_net::MissingPolicy;
use glimpse_core::scan::Scan;

use super::contents::CompletedContents;
use super::reference::{Readings, TOLERANCE, innovation};
use super::scans::{Any, cases, record_readings};

/// The results of a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Estimate {
    mean_residual: f32,
    predicted_loss: Option<f32>,
    loss_bound: Option<f32>,
    is_unlike_training: Option<bool>,
}

fn estimate(contents: &CompletedContents, readings: &Readings, budget: u32) -> Estimate {
    let recipe = contents.recipe();
    // A fit writes all the words that it reads.
    let mut memory = vec![f32::NAN; recipe.memory_words()];
    let mut scan = Scan::<Any>::new(recipe, &mut memory).unwrap();
    record_readings(&mut scan, readings);
    let mut fit = scan.fit().unwrap();
    while !fit.advance(budget).is_complete() {}
    let _ = fit.finish(); // may be implausible
    let fitted = scan.fitted().unwrap();
    Estimate {
        mean_residual: fitted.residual().mean,
        predicted_loss: fitted.predicted_loss(),
        loss_bound: fitted.loss_bound(),
        is_unlike_training: fitted.is_unlike_training(),
    }
}

/// Small recipes that state the given innovation of training materials.
fn all_small(max_innovation: f32) -> Vec<CompletedContents> {
    let mut all = CompletedContents::all_small(MissingPolicy::Scaled);
    for contents in &mut all {
        contents.prediction = Some(vec![-4.0, 0.0, 0.0, 0.0, 0.0]);
        contents.uncertainty = Some(Uncertainty {
            innovation: 0.7,
            residual: 0.4,
            bound: 2.5,
            max_innovation,
        });
    }
    all
}

/// The comparison finds an innovation 5 % above that of the training materials, and not one 5 % below. The gradient of a
/// descent does not overwrite it.
#[test]
fn innovation_above_training_is_unlike() {
    let mut corrected = 0;
    for contents in all_small(1.0) {
        let Some(correction_part) = &contents.correction else {
            continue;
        };
        assert!(!correction_part.rows.is_empty());
        corrected += 1;
        for readings in cases() {
            let innovation = innovation(&contents, &contents.recipe(), &readings);
            assert!(innovation > 0.1);
            for (factor, expected) in [(0.95, true), (1.05, false)] {
                let mut contents = contents.clone();
                let uncertainty = contents.uncertainty.as_mut().unwrap();
                uncertainty.max_innovation = (factor * innovation) as f32;
                for budget in [1, 3, u32::MAX] {
                    let is_unlike = estimate(&contents, &readings, budget).is_unlike_training;
                    assert_eq!(is_unlike, Some(expected), "{}", contents.model());
                }
            }
        }
    }
    // Four models, and three of them also with Gauss-Newton steps.
    assert_eq!(corrected, 4 + 3);
}

#[test]
fn predicted_loss_matches_formula() {
    for contents in all_small(1.0) {
        for readings in cases() {
            let estimate = estimate(&contents, &readings, 5);
            let mut expected = -4.0 + 0.4 * (f64::from(estimate.mean_residual) + 1e-4).ln();
            if contents.correction.is_some() {
                let innovation = innovation(&contents, &contents.recipe(), &readings);
                expected += 0.7 * (innovation + 1e-3).ln();
            }
            let predicted = f64::from(estimate.predicted_loss.unwrap());
            let error = (predicted / expected.exp() - 1.0).abs();
            assert!(error < 10.0 * TOLERANCE, "{}: {error}", contents.model());
            let bound = estimate.loss_bound.unwrap();
            assert_eq!(bound, 2.5 * estimate.predicted_loss.unwrap());
        }
    }
}

/// The comparison with the training needs the innovation of a correction and the limit in section 135.
#[test]
fn no_comparison_without_correction_or_section() {
    let readings = &cases()[0];
    for mut contents in all_small(1.0) {
        let is_unlike =
            |contents: &CompletedContents| estimate(contents, readings, 5).is_unlike_training;
        let has_correction = contents.correction.is_some();
        assert_eq!(is_unlike(&contents).is_some(), has_correction);
        contents.uncertainty = None;
        assert_eq!(is_unlike(&contents), None);
    }
}
