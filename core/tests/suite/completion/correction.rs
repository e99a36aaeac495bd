//! The correction of coefficients matches its formula in f64, for every model, with and without missing readings.

use glimpse_core::fit::coefficient_net::MissingPolicy;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{MAX_PRECISION, MIN_PRECISION};
use proptest::prelude::*;

use super::contents::{CORRECTED, CompletedContents, CorrectionPart, SAMPLES};
use super::reference::{
    SYSTEM_TOLERANCE, all_readings, assert_within, expected_values, largest_difference,
};
use super::scans::{Any, cases, full_scan, full_scan_by_type, without_steps};
use crate::scanning::{MODELS, Outcome};

/// Contents without steps: a fit ends with Linear's coefficients or with the initial values.
fn contents(model: ModelKind, components: usize, missing: MissingPolicy) -> CompletedContents {
    without_steps(&CompletedContents::small(model, missing)).corrected(components)
}

fn linear() -> CompletedContents {
    contents(ModelKind::Linear, CORRECTED, MissingPolicy::Scaled)
}

fn correction_mut(contents: &mut CompletedContents) -> &mut CorrectionPart {
    contents.correction.as_mut().unwrap()
}

#[test]
fn corrected_values_match_formulas() {
    for model in MODELS {
        // K is m, the number of samples, or larger.
        for components in [4, CORRECTED, 20] {
            for missing in [MissingPolicy::Unscaled, MissingPolicy::Scaled] {
                let contents = contents(model, components, missing);
                for readings in cases() {
                    let values = full_scan_by_type(&contents, &readings).values();
                    let expected = expected_values(&contents, &contents.recipe(), &readings);
                    let values = values.into_iter();
                    assert_within(SYSTEM_TOLERANCE, model.name(), values, &expected);
                }
            }
        }
    }
}

/// Each field changes the result of the formulas by more than the tolerance, so that the comparison detects a wrong use.
#[test]
fn reference_depends_on_each_field() {
    let before = linear();
    let changes: [fn(&mut CompletedContents); 5] = [
        |contents| contents.correction = None,
        |contents| correction_mut(contents).rows.swap(0, 1),
        |contents| correction_mut(contents).row_scales.swap(0, 5),
        |contents| correction_mut(contents).precision[0] *= 1.5,
        |contents| correction_mut(contents).precision[5] *= 1.5,
    ];
    let values = |contents: &CompletedContents| {
        expected_values(contents, &before.recipe(), &all_readings(SAMPLES))
    };
    for (index, change) in changes.into_iter().enumerate() {
        let mut after = before.clone();
        change(&mut after);
        let difference = largest_difference(&values(&before), &values(&after));
        assert!(
            difference > 2.0 * SYSTEM_TOLERANCE,
            "change {index}: {difference}"
        );
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

#[test]
fn overflow_diverges() {
    for model in MODELS {
        // The squares of the components overflow.
        let mut contents = contents(model, CORRECTED, MissingPolicy::Scaled);
        correction_mut(&mut contents).row_scales.fill(1e30);
        let outcome = full_scan::<Any>(&contents, &all_readings(SAMPLES));
        assert_eq!(outcome, Outcome::Diverged, "{model}");
    }
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
        let mut contents = contents(MODELS[model], CORRECTED, MissingPolicy::Scaled);
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
