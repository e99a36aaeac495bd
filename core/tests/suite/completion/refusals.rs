//! Recipes that complete readings are refused by the name of their fault.

use glimpse_core::fit::coefficient_net::MissingPolicy;
use glimpse_core::fit::{MAX_ROWS, MAX_UNITS};
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{Field, HEADER_BYTES, Kind, Recipe, RecipeError, VERSION};

use super::made::{Descends, Made, SAMPLES, Starts};
use crate::recipes::{
    Change, Sections, body_of, recipe_with, refusal, sealed, section_mut, sections_of,
};

/// Any model's recipe has a completion, one of the last three a descent and a start too.
const ALL: [ModelKind; 4] = [
    ModelKind::Linear,
    ModelKind::Phong,
    ModelKind::CookTorrance,
    ModelKind::Neural,
];
const LINEAR: [ModelKind; 1] = [ModelKind::Linear];
const PHONG: [ModelKind; 1] = [ModelKind::Phong];

fn small(model: ModelKind) -> Made {
    Made::small(model, MissingPolicy::Scaled)
}

fn descends(made: &mut Made) -> &mut Descends {
    &mut made.then.as_mut().unwrap().0
}

fn starts(made: &mut Made) -> &mut Starts {
    &mut made.then.as_mut().unwrap().1
}

/// Each change to a recipe of these models is refused because of its field.
fn assert_refused(
    models: &[ModelKind],
    error: fn(Field) -> RecipeError,
    changes: &[Change<Field, Made>],
) {
    for (index, (field, change)) in changes.iter().enumerate() {
        for model in models {
            let mut made = small(*model);
            change(&mut made);
            let found = made.write();
            assert_eq!(found, Err(error(*field)), "change {index} of {model}");
        }
    }
}

#[test]
fn wrong_counts_are_refused() {
    assert_refused(
        &ALL,
        RecipeError::Count,
        &[
            (Field::Components, |made| made.components = 0),
            (Field::Components, |made| made.components = 10),
            (Field::Bias, |made| made.bias.clear()),
            (Field::Bias, |made| made.bias = vec![0.5; MAX_ROWS + 1]),
            (Field::Pattern, |made| made.pattern.push(0.1)),
            (Field::Readings, |made| made.readings.push(1)),
            (Field::Readings, |made| made.readings.truncate(161)),
            (Field::Readings, |made| made.readings.clear()),
            (Field::ReadingScales, |made| made.reading_scales.push(0.1)),
            (Field::ReadingScales, |made| made.reading_scales.clear()),
            (Field::Output, |made| made.output.push(1)),
            (Field::Output, |made| made.output.clear()),
            (Field::OutputScales, |made| made.output_scales.push(0.1)),
            (Field::OutputScales, |made| made.output_scales.truncate(3)),
            (Field::Center, |made| made.center.push(0.1)),
            (Field::Center, |made| made.center.truncate(5)),
            (Field::Center, |made| made.center.clear()),
        ],
    );
    assert_refused(
        &LINEAR,
        RecipeError::Count,
        &[
            (Field::Rows, |made| made.rows.push(1)),
            (Field::Rows, |made| made.rows.clear()),
            (Field::RowScales, |made| made.row_scales.push(0.1)),
            (Field::RowScales, |made| made.row_scales.clear()),
        ],
    );
    assert_refused(
        &PHONG,
        RecipeError::Count,
        &[
            (Field::InnerSteps, |made| descends(made).inner_steps = 0),
            (Field::Initial, |made| descends(made).initial.push(0.1)),
            (Field::StepSizes, |made| {
                descends(made).step_sizes.truncate(6)
            }),
            (Field::Initial, |made| {
                descends(made).model = ModelKind::Neural
            }),
            (Field::StartBias, |made| starts(made).bias.clear()),
            (Field::StartBias, |made| {
                starts(made).bias = vec![0.5; MAX_UNITS + 1]
            }),
            (Field::StartHidden, |made| starts(made).bias.push(0.1)),
            (Field::StartHidden, |made| starts(made).hidden.push(1)),
            (Field::StartHidden, |made| starts(made).hidden.clear()),
            (Field::StartHiddenScales, |made| {
                starts(made).hidden_scales.push(0.1)
            }),
            (Field::StartOutput, |made| starts(made).output.truncate(20)),
            (Field::StartOutputScales, |made| {
                starts(made).output_scales.push(0.1)
            }),
            (Field::StartOutputScales, |made| {
                starts(made).output_scales.truncate(6)
            }),
        ],
    );
    let mut made = small(ModelKind::Phong);
    descends(&mut made).model = ModelKind::Linear;
    assert_eq!(made.write(), Err(RecipeError::Model(ModelKind::Linear)));
}

/// Components at the sampled directions, and a basis, are Linear's: next to a start they would have no
/// meaning.
#[test]
fn a_start_excludes_components_of_linear() {
    assert_refused(
        &ALL[1..],
        RecipeError::Unused,
        &[
            (Field::Rows, |made| made.rows = vec![1; 24]),
            (Field::RowScales, |made| made.row_scales = vec![0.1; 4]),
            (Field::BasisChecksum, |made| made.basis_checksum = 1),
        ],
    );
    let text = RecipeError::Unused(Field::Rows).to_string();
    for part in [Field::Rows.name(), &Kind::START.to_string()] {
        assert!(text.contains(part), "{text}");
    }
    // A recipe that another writer wrote is checked when it is read.
    let mut sections = sections(ModelKind::Phong);
    // The checksum comes last, and is a 0 of one byte.
    let last = section_mut(&mut sections, Kind::COMPLETION).last_mut();
    assert_eq!(std::mem::replace(last.unwrap(), 1), 0);
    let error = RecipeError::Unused(Field::BasisChecksum);
    assert_eq!(refusal(&recipe_with(&sections)), error);
}

#[test]
fn the_largest_counts_are_not_refused() {
    for (components, hidden) in [(1, MAX_ROWS - 1), (MAX_ROWS, 0)] {
        for model in [ModelKind::Linear, ModelKind::Phong] {
            let shape = [SAMPLES, components, hidden, MAX_UNITS];
            let made = Made::new(model, shape, MissingPolicy::Scaled);
            assert!(made.write().is_ok(), "{model}");
        }
    }
}

#[test]
fn numbers_that_are_not_finite_are_refused() {
    assert_refused(
        &ALL,
        RecipeError::NonFinite,
        &[
            (Field::Center, |made| made.center[5] = f32::NAN),
            (Field::Scale, |made| made.scale = f32::INFINITY),
            (Field::ReadingScales, |made| {
                made.reading_scales[8] = f32::NAN
            }),
            (Field::Bias, |made| made.bias[8] = f32::NEG_INFINITY),
            (Field::OutputScales, |made| made.output_scales[3] = f32::NAN),
        ],
    );
    assert_refused(
        &LINEAR,
        RecipeError::NonFinite,
        &[(Field::RowScales, |made| made.row_scales[3] = f32::NAN)],
    );
    assert_refused(
        &PHONG,
        RecipeError::NonFinite,
        &[
            (Field::Initial, |made| descends(made).initial[6] = f32::NAN),
            (Field::StepSizes, |made| {
                descends(made).step_sizes[0] = f32::INFINITY
            }),
            (Field::StartBias, |made| starts(made).bias[2] = f32::NAN),
            (Field::StartHiddenScales, |made| {
                starts(made).hidden_scales[2] = f32::INFINITY
            }),
            (Field::StartOutputScales, |made| {
                starts(made).output_scales[6] = f32::NAN
            }),
        ],
    );
}

#[test]
fn numbers_out_of_their_range_are_refused() {
    assert_refused(
        &ALL,
        RecipeError::NotPositive,
        &[
            (Field::Scale, |made| made.scale = 0.0),
            (Field::Scale, |made| made.scale = -1.0),
        ],
    );
    assert_refused(
        &ALL,
        RecipeError::Range,
        &[
            (Field::Center, |made| made.center[0] = 100.1),
            (Field::Center, |made| made.center[0] = -100.1),
            (Field::Missing, |made| made.missing = 3),
        ],
    );
    // Scales of a row may be of either sign, and 0 for a row without effect.
    let mut made = small(ModelKind::Phong);
    made.reading_scales.fill(0.0);
    made.output_scales.fill(-1.0);
    assert!(made.write().is_ok());
}

/// The sections of a valid recipe.
fn sections(model: ModelKind) -> Sections {
    sections_of(&small(model).write().unwrap())
}

#[test]
fn a_companion_that_is_missing_or_too_many_is_named() {
    let (descent, completion, start) = (Kind::DESCENT, Kind::COMPLETION, Kind::START);
    let phong = |kinds: &[Kind]| {
        let mut sections = sections(ModelKind::Phong);
        sections.retain(|(kind, _)| *kind == Kind::PATTERN || kinds.contains(kind));
        sections
    };
    for (kinds, error) in [
        (&[][..], RecipeError::Learners(0)),
        (&[completion, start], RecipeError::Missing(descent)),
        (&[descent, start], RecipeError::Missing(completion)),
        (&[descent, completion], RecipeError::Missing(start)),
        (&[start], RecipeError::Missing(descent)),
        // A completion that was written for a start has no components of Linear.
        (&[completion], RecipeError::Count(Field::Rows)),
    ] {
        assert_eq!(refusal(&recipe_with(&phong(kinds))), error, "{kinds:?}");
    }

    // A ridge is by itself; a start next to it is not a second method.
    let (learners, beside) = (RecipeError::Learners(2), RecipeError::Beside(start));
    for (others, error) in [
        (&[completion][..], learners),
        (&[start], beside),
        (&[descent], learners),
        (&[descent, start], learners),
        (&[completion, start], learners),
        (&[descent, completion, start], learners),
    ] {
        let mut sections = phong(others);
        sections.push((Kind::RIDGE, vec![1, 0, 0, 0, 0, 0, 0]));
        sections.sort();
        assert_eq!(refusal(&recipe_with(&sections)), error, "{others:?}");
    }
    for (error, kind) in [
        (beside, start),
        (beside, Kind::RIDGE),
        (RecipeError::Missing(descent), descent),
    ] {
        let message = error.to_string();
        assert!(message.contains(&kind.to_string()), "{message}");
    }
}

/// Of a recipe that was cut and sealed again, whole sections are read.
#[test]
fn a_body_that_was_cut_is_refused() {
    for (model, last) in [
        (ModelKind::Linear, &[Kind::COMPLETION][..]),
        // The descent that it holds is a recipe too.
        (ModelKind::Phong, &[Kind::DESCENT, Kind::START]),
    ] {
        let bytes = small(model).write().unwrap();
        let sections = sections(model);
        let all = body_of(&sections);
        assert_eq!(all, bytes[HEADER_BYTES..]);
        let whole: Vec<usize> = last
            .iter()
            .map(|last| {
                let end = sections.iter().position(|(kind, _)| kind == last).unwrap();
                body_of(&sections[..=end]).len()
            })
            .collect();
        for length in 0..all.len() {
            let is_read = Recipe::parse(&sealed(VERSION, &all[..length])).is_ok();
            assert_eq!(is_read, whole.contains(&length), "{length}");
        }
    }
}

/// Whatever a byte is changed to, the recipe is refused or can be copied.
#[test]
fn altered_bytes_are_refused_or_harmless() {
    for model in [ModelKind::Linear, ModelKind::Phong] {
        let mut all = body_of(&sections(model));
        for index in 0..all.len() {
            let before = all[index];
            for after in [0, 0x7F, 0x80, 0xFF, before ^ 1] {
                all[index] = after;
                let bytes = sealed(VERSION, &all);
                if let Ok(recipe) = Recipe::parse(&bytes) {
                    let mut buffer = vec![0; bytes.len()];
                    assert_eq!(recipe.copy_without(&[], &mut buffer), Ok(&bytes[..]));
                }
            }
            all[index] = before;
        }
    }
}
