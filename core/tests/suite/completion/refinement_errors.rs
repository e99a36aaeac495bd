//! Errors of corrections and Gauss-Newton steps.

use glimpse_core::fit::coefficient_net::MissingPolicy;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{
    Field, Kind, MAX_COMPONENTS, MAX_GAUSS_NEWTON_STEPS, MAX_PRECISION, MAX_READING_WEIGHT,
    MAX_VIRTUAL_READINGS, MIN_PRECISION, Recipe, RecipeError,
};

use super::contents::{CORRECTED, CompletedContents, CorrectionPart, GaussNewtonPart};
use crate::recipes::{Change, linear, parse_error, recipe_with, sections_of};

fn correction_mut(contents: &mut CompletedContents) -> &mut CorrectionPart {
    contents.correction.as_mut().unwrap()
}

fn steps_mut(contents: &mut CompletedContents) -> &mut GaussNewtonPart {
    contents.gauss_newton.as_mut().unwrap()
}

fn phong() -> CompletedContents {
    CompletedContents::small(ModelKind::Phong, MissingPolicy::Scaled)
}

/// Small recipes that meet a condition.
fn recipes(condition: fn(&CompletedContents) -> bool) -> Vec<CompletedContents> {
    let all = CompletedContents::all_small(MissingPolicy::Scaled).into_iter();
    all.filter(condition).collect()
}

/// Checks that each change to each of these recipes is rejected with an error of its field.
#[track_caller]
fn assert_rejected<T>(
    recipes: &[CompletedContents],
    part: fn(&mut CompletedContents) -> &mut T,
    error: fn(Field) -> RecipeError,
    changes: &[Change<Field, T>],
) {
    for (index, (field, change)) in changes.iter().enumerate() {
        for contents in recipes {
            let mut contents = contents.clone();
            change(part(&mut contents));
            let actual = contents.write();
            let model = contents.model();
            assert_eq!(actual, Err(error(*field)), "change {index} of {model}");
        }
    }
}

#[test]
fn rejects_invalid_corrections() {
    let corrected = recipes(|contents| contents.correction.is_some());
    let check = |error, changes: &[Change<Field, CorrectionPart>]| {
        assert_rejected(&corrected, correction_mut, error, changes);
    };
    check(
        RecipeError::Count,
        &[
            // A correction has at least m components.
            (Field::CorrectionPrecision, |part| {
                part.precision.truncate(3)
            }),
            (Field::CorrectionPrecision, |part| part.precision.clear()),
            (Field::CorrectionPrecision, |part| {
                part.precision = vec![1.0; MAX_COMPONENTS + 1]
            }),
            (Field::CorrectionRows, |part| part.precision.push(1.0)),
            (Field::CorrectionRows, |part| part.rows.push(1)),
            (Field::CorrectionRows, |part| part.rows.clear()),
            (Field::CorrectionRowScales, |part| part.row_scales.push(0.1)),
            (Field::CorrectionRowScales, |part| part.row_scales.clear()),
        ],
    );
    check(
        RecipeError::NonFinite,
        &[
            (Field::CorrectionRowScales, |part| {
                part.row_scales[5] = f32::NAN
            }),
            (Field::CorrectionPrecision, |part| {
                part.precision[5] = f32::INFINITY
            }),
        ],
    );
    check(
        RecipeError::NotPositive,
        &[
            (Field::CorrectionPrecision, |part| part.precision[0] = 0.0),
            (Field::CorrectionPrecision, |part| part.precision[5] = -1.0),
        ],
    );
    check(
        RecipeError::Range,
        &[
            (Field::CorrectionPrecision, |part| {
                part.precision[0] = 0.5 * MIN_PRECISION
            }),
            (Field::CorrectionPrecision, |part| {
                part.precision[5] = 2.0 * MAX_PRECISION
            }),
        ],
    );
}

/// The rows of a correction replace those of the completion.
#[test]
fn correction_excludes_rows_of_completion() {
    let corrected = recipes(|contents| contents.correction.is_some());
    assert_rejected::<CompletedContents>(
        &corrected,
        |contents| contents,
        RecipeError::Unused,
        &[
            (Field::Rows, |contents| contents.rows = vec![1; 24]),
            (Field::RowScales, |contents| {
                contents.row_scales = vec![0.1; 4]
            }),
        ],
    );
    let text = RecipeError::Unused(Field::Rows).to_string();
    assert!(text.contains(&Kind::CORRECTION.to_string()), "{text}");
}

#[test]
fn rejects_wrong_counts_of_steps() {
    let stepped = recipes(|contents| contents.gauss_newton.is_some());
    assert_rejected(
        &stepped,
        steps_mut,
        RecipeError::Count,
        &[
            (Field::StepCount, |part| part.steps = 0),
            (Field::StepCount, |part| {
                part.steps = MAX_GAUSS_NEWTON_STEPS + 1
            }),
            (Field::StepInitial, |part| part.initial.push(0.1)),
            (Field::StepInitial, |part| part.initial.clear()),
            (Field::StepPrecision, |part| part.precision.push(1.0)),
            (Field::StepPrecision, |part| part.precision.truncate(6)),
            (Field::VirtualDirections, |part| part.directions.push(0.1)),
            (Field::VirtualDirections, |part| part.directions.clear()),
            (Field::VirtualDirections, |part| {
                part.directions = vec![0.1; 3 * MAX_VIRTUAL_READINGS + 3]
            }),
            (Field::VirtualCenter, |part| part.directions.truncate(18)),
            (Field::VirtualCenter, |part| part.center.push(4.0)),
            (Field::VirtualRows, |part| part.rows.push(1)),
            (Field::VirtualRows, |part| part.rows.clear()),
            (Field::VirtualRowScales, |part| part.row_scales.push(0.1)),
            (Field::VirtualRowScales, |part| part.row_scales.truncate(3)),
        ],
    );
    let mut contents = phong().stepped();
    for (model, error) in [
        (ModelKind::Linear, RecipeError::Model(ModelKind::Linear)),
        (ModelKind::Neural, RecipeError::Count(Field::StepInitial)),
    ] {
        steps_mut(&mut contents).model = model;
        assert_eq!(contents.write(), Err(error));
    }
}

#[test]
fn rejects_invalid_numbers_of_steps() {
    let stepped = recipes(|contents| contents.gauss_newton.is_some());
    let check = |error, changes: &[Change<Field, GaussNewtonPart>]| {
        assert_rejected(&stepped, steps_mut, error, changes);
    };
    check(
        RecipeError::NonFinite,
        &[
            (Field::StepInitial, |part| part.initial[6] = f32::NAN),
            (Field::StepPrecision, |part| part.precision[6] = f32::NAN),
            (Field::ReadingWeight, |part| part.reading_weight = f32::NAN),
            (Field::ErrorScale, |part| part.error_scale = f32::INFINITY),
            (Field::VirtualDirections, |part| {
                part.directions[20] = f32::NAN
            }),
            (Field::VirtualCenter, |part| part.center[6] = f32::INFINITY),
            (Field::VirtualRowScales, |part| {
                part.row_scales[3] = f32::NEG_INFINITY
            }),
        ],
    );
    check(
        RecipeError::NotPositive,
        &[
            (Field::StepPrecision, |part| part.precision[0] = 0.0),
            (Field::ReadingWeight, |part| part.reading_weight = 0.0),
            (Field::ReadingWeight, |part| part.reading_weight = -1.0),
            (Field::ErrorScale, |part| part.error_scale = 0.0),
            (Field::ErrorScale, |part| part.error_scale = -1.0),
        ],
    );
    check(
        RecipeError::Range,
        &[
            (Field::StepPrecision, |part| {
                part.precision[0] = 0.5 * MIN_PRECISION
            }),
            (Field::StepPrecision, |part| {
                part.precision[6] = 2.0 * MAX_PRECISION
            }),
            (Field::ReadingWeight, |part| {
                part.reading_weight = 1.1 * MAX_READING_WEIGHT
            }),
            (Field::ErrorScale, |part| {
                part.error_scale = 1.1 * MAX_READING_WEIGHT
            }),
            (Field::VirtualDirections, |part| part.directions[2] = 1001.0),
            // Below the horizon.
            (Field::VirtualDirections, |part| part.directions[18] = 1.6),
            (Field::VirtualCenter, |part| part.center[0] = 100.1),
            (Field::VirtualCenter, |part| part.center[6] = -100.1),
        ],
    );
}

#[test]
fn init_net_takes_corrected_coefficients() {
    for contents in recipes(|contents| contents.init_net.is_some()) {
        let mut contents = contents;
        let inputs = 3 * contents.fitted_components();
        let init_net_part = contents.init_net.as_mut().unwrap();
        assert_eq!(init_net_part.hidden.len(), 3 * inputs);
        let other = if inputs == 12 { 18 } else { 12 };
        init_net_part.hidden.resize(3 * other, 1);
        let error = RecipeError::Count(Field::StartHidden);
        assert_eq!(contents.write(), Err(error));
    }
}

#[test]
fn accepts_largest_counts() {
    let mut contents = phong().corrected(CORRECTED).stepped();
    let steps = steps_mut(&mut contents);
    steps.steps = MAX_GAUSS_NEWTON_STEPS;
    steps.directions = vec![0.1; 3 * MAX_VIRTUAL_READINGS];
    steps.center = vec![0.1; MAX_VIRTUAL_READINGS];
    steps.rows = vec![1; CORRECTED * MAX_VIRTUAL_READINGS];
    assert!(contents.write().is_ok());
    let contents = phong().corrected(MAX_COMPONENTS);
    assert_eq!(
        contents.recipe().completed().unwrap().components(),
        MAX_COMPONENTS
    );
}

#[test]
fn names_missing_and_extra_sections() {
    let [descent, completion] = [Kind::DESCENT, Kind::COMPLETION];
    let [start, steps, correction] = [Kind::START, Kind::GAUSS_NEWTON, Kind::CORRECTION];
    // All sections of valid recipes, those of the completion for Gauss-Newton steps without a correction.
    let mut all = sections_of(&phong().stepped().write().unwrap());
    let corrected = phong().corrected(CORRECTED).write().unwrap();
    let with = |kind| move |section: &(Kind, Vec<u8>)| section.0 == kind;
    all.extend(
        sections_of(&phong().write().unwrap())
            .into_iter()
            .find(with(descent)),
    );
    all.extend(sections_of(&corrected).into_iter().find(with(correction)));
    all.extend(
        sections_of(&linear().write().unwrap())
            .into_iter()
            .find(with(Kind::RIDGE)),
    );
    all.sort();
    let (two, missing) = (RecipeError::Learners(2), RecipeError::Missing);
    for (kinds, error) in [
        (&[steps][..], missing(completion)),
        (&[start, steps], missing(completion)),
        (&[completion, steps], missing(start)),
        (&[completion, start], missing(descent)),
        (&[start], missing(descent)),
        (&[descent, steps], two),
        (&[descent, start, steps], two),
        (&[descent, completion, steps], two),
        (&[descent, completion, start, steps], two),
        (&[Kind::RIDGE, steps], RecipeError::Beside(steps)),
        (&[Kind::RIDGE, start, steps], RecipeError::Beside(start)),
        (&[Kind::RIDGE, completion, start, steps], two),
        (&[Kind::RIDGE, descent, steps], two),
        // A correction is not a method.
        (&[correction], missing(completion)),
        (&[descent, correction], missing(completion)),
        (&[Kind::RIDGE, correction], missing(completion)),
        (&[start, steps, correction], missing(completion)),
        (&[completion, start, correction], missing(descent)),
        (&[completion, steps, correction], missing(start)),
        (&[Kind::RIDGE, completion, correction], two),
    ] {
        let mut sections = all.clone();
        sections.retain(|(kind, _)| *kind == Kind::PATTERN || kinds.contains(kind));
        assert_eq!(sections.len(), kinds.len() + 1);
        assert_eq!(parse_error(&recipe_with(&sections)), error, "{kinds:?}");
    }
    let mut sections = all;
    sections.retain(|(kind, _)| [Kind::PATTERN, completion, start, steps].contains(kind));
    assert!(Recipe::parse(&recipe_with(&sections)).is_ok());
    let text = RecipeError::Beside(steps).to_string();
    assert!(text.contains(&steps.to_string()), "{text}");
}
