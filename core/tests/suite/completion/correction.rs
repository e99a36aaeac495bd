//! Completed and corrected coefficients match their formulas in f64, for every model, with and without missing readings.

use glimpse_core::fit::coefficient_net::MissingPolicy;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{MAX_PRECISION, MIN_PRECISION};
use proptest::prelude::*;

use super::contents::{CORRECTED, CompletedContents, CorrectionPart, SAMPLES};
use super::reference::{SYSTEM_TOLERANCE, TOLERANCE, all_readings, assert_within, expected_values};
use super::scans::{Any, cases, full_scan, full_scan_by_type, without_steps};
use crate::scanning::{MODELS, Outcome};

/// Contents without steps: a fit ends with Linear's coefficients or with the initial values.
fn contents(model: ModelKind) -> CompletedContents {
    without_steps(&CompletedContents::small(model, MissingPolicy::Scaled)).corrected(CORRECTED)
}

fn linear() -> CompletedContents {
    contents(ModelKind::Linear)
}

fn correction_mut(contents: &mut CompletedContents) -> &mut CorrectionPart {
    contents.correction.as_mut().unwrap()
}

#[test]
fn values_match_formulas() {
    for model in MODELS {
        for missing in [MissingPolicy::Unscaled, MissingPolicy::Scaled] {
            let plain = without_steps(&CompletedContents::small(model, missing));
            // K is m, the number of samples, or larger.
            let corrected =
                [4, CORRECTED, 20].map(|k| (plain.clone().corrected(k), SYSTEM_TOLERANCE));
            for (contents, tolerance) in [(plain, TOLERANCE)].into_iter().chain(corrected) {
                for readings in cases() {
                    let values = full_scan_by_type(&contents, &readings).values();
                    let expected = expected_values(&contents, &contents.recipe(), &readings);
                    assert_within(tolerance, model.name(), values.into_iter(), &expected);
                }
            }
        }
    }
}

#[test]
fn large_precision_keeps_coefficients() {
    let mut contents = linear();
    correction_mut(&mut contents).precision.fill(MAX_PRECISION);
    let plain = CompletedContents::small(ModelKind::Linear, MissingPolicy::Scaled);
    for readings in cases() {
        let plain = full_scan_by_type(&plain, &readings).values();
        let [red, green, blue] = [0, 1, 2].map(|channel| &plain[4 * channel..][..4]);
        let expected = [red, &[0.0; 2], green, &[0.0; 2], blue, &[0.0; 2]].concat();
        let expected: Vec<f64> = expected.into_iter().map(f64::from).collect();
        let values = full_scan_by_type(&contents, &readings).values();
        assert_within(1e-6, "coefficient", values.into_iter(), &expected);
    }
}

/// As many components as samples explain all readings.
#[test]
fn small_precision_explains_readings() {
    let mut contents = linear();
    correction_mut(&mut contents).precision.fill(1e-4);
    let residual = full_scan_by_type(&contents, &all_readings(SAMPLES)).residual();
    let before = full_scan_by_type(&linear(), &all_readings(SAMPLES)).residual();
    assert!(residual.mean < 1e-3 && before.mean > 1e-2, "{residual:?}");
}

proptest! {
    /// Random valid recipes give finite values, or a reported divergence.
    #[test]
    fn correction_of_any_numbers_fits_or_diverges(
        model in 0..MODELS.len(),
        rows in prop::collection::vec(any::<i8>(), SAMPLES * CORRECTED),
        scales in prop::collection::vec(-38.0..38.0_f32, CORRECTED),
        precisions in prop::collection::vec(-5.99..7.99_f32, CORRECTED),
    ) {
        let mut contents = contents(MODELS[model]);
        let power = |exponent: &f32| 10.0_f32.powf(*exponent);
        contents.correction = Some(CorrectionPart {
            rows,
            row_scales: scales.iter().map(power).collect(),
            precision: precisions.iter().map(power).collect(),
        });
        prop_assert!(precisions.iter().all(|p| power(p) >= MIN_PRECISION));
        let outcome = full_scan::<Any>(&contents, &all_readings(SAMPLES));
        let is_valid = matches!(outcome, Outcome::Fitted(..) | Outcome::Diverged);
        prop_assert!(is_valid, "{:?}", outcome);
    }
}
