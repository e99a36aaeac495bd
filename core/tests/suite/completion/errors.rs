//! Errors of recipes that complete readings.

use glimpse_core::fit::coefficient_net::MissingPolicy;
use glimpse_core::fit::{MAX_ROWS, MAX_UNITS};
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{Field, HEADER_BYTES, Kind, Recipe, RecipeError, VERSION, memory_words};

use super::contents::{CORRECTED, CompletedContents, DescentPart, InitNetPart, SAMPLES};
use crate::recipes::{
    Change, Sections, body_of, parse_error, recipe_with, section_mut, sections_of, with_header,
};

/// Recipes of all models have a completion section. Recipes of the last three also have descent and start sections.
const ALL: [ModelKind; 4] = [
    ModelKind::Linear,
    ModelKind::Phong,
    ModelKind::CookTorrance,
    ModelKind::Neural,
];
const LINEAR: [ModelKind; 1] = [ModelKind::Linear];
const PHONG: [ModelKind; 1] = [ModelKind::Phong];

fn small(model: ModelKind) -> CompletedContents {
    CompletedContents::small(model, MissingPolicy::Scaled)
}

fn descent_mut(contents: &mut CompletedContents) -> &mut DescentPart {
    contents.descent.as_mut().unwrap()
}

fn init_net_mut(contents: &mut CompletedContents) -> &mut InitNetPart {
    contents.init_net.as_mut().unwrap()
}

/// Checks that each change to a recipe of these models is rejected with an error of its field.
fn assert_rejected(
    models: &[ModelKind],
    error: fn(Field) -> RecipeError,
    changes: &[Change<Field, CompletedContents>],
) {
    for (index, (field, change)) in changes.iter().enumerate() {
        for model in models {
            let mut contents = small(*model);
            change(&mut contents);
            let actual = contents.write();
            assert_eq!(actual, Err(error(*field)), "change {index} of {model}");
        }
    }
}

#[test]
fn rejects_wrong_counts() {
    assert_rejected(
        &ALL,
        RecipeError::Count,
        &[
            (Field::Components, |contents| contents.components = 0),
            (Field::Components, |contents| contents.components = 10),
            (Field::Bias, |contents| contents.bias.clear()),
            (Field::Bias, |contents| {
                contents.bias = vec![0.5; MAX_ROWS + 1]
            }),
            (Field::Pattern, |contents| contents.pattern.push(0.1)),
            (Field::Readings, |contents| contents.readings.push(1)),
            (Field::Readings, |contents| contents.readings.truncate(161)),
            (Field::Readings, |contents| contents.readings.clear()),
            (Field::ReadingScales, |contents| {
                contents.reading_scales.push(0.1)
            }),
            (Field::ReadingScales, |contents| {
                contents.reading_scales.clear()
            }),
            (Field::Output, |contents| contents.output.push(1)),
            (Field::Output, |contents| contents.output.clear()),
            (Field::OutputScales, |contents| {
                contents.output_scales.push(0.1)
            }),
            (Field::OutputScales, |contents| {
                contents.output_scales.truncate(3)
            }),
            (Field::Center, |contents| contents.center.push(0.1)),
            (Field::Center, |contents| contents.center.truncate(5)),
            (Field::Center, |contents| contents.center.clear()),
        ],
    );
    assert_rejected(
        &LINEAR,
        RecipeError::Count,
        &[
            (Field::Rows, |contents| contents.rows.push(1)),
            (Field::Rows, |contents| contents.rows.clear()),
            (Field::RowScales, |contents| contents.row_scales.push(0.1)),
            (Field::RowScales, |contents| contents.row_scales.clear()),
        ],
    );
    assert_rejected(
        &PHONG,
        RecipeError::Count,
        &[
            (Field::InnerSteps, |contents| {
                descent_mut(contents).inner_steps = 0
            }),
            (Field::Initial, |contents| {
                descent_mut(contents).initial.push(0.1)
            }),
            (Field::StepSizes, |contents| {
                descent_mut(contents).step_sizes.truncate(6)
            }),
            (Field::Initial, |contents| {
                descent_mut(contents).model = ModelKind::Neural
            }),
            (Field::StartBias, |contents| {
                init_net_mut(contents).bias.clear()
            }),
            (Field::StartBias, |contents| {
                init_net_mut(contents).bias = vec![0.5; MAX_UNITS + 1]
            }),
            (Field::StartHidden, |contents| {
                init_net_mut(contents).bias.push(0.1)
            }),
            (Field::StartHidden, |contents| {
                init_net_mut(contents).hidden.push(1)
            }),
            (Field::StartHidden, |contents| {
                init_net_mut(contents).hidden.clear()
            }),
            (Field::StartHiddenScales, |contents| {
                init_net_mut(contents).hidden_scales.push(0.1)
            }),
            (Field::StartOutput, |contents| {
                init_net_mut(contents).output.truncate(20)
            }),
            (Field::StartOutputScales, |contents| {
                init_net_mut(contents).output_scales.push(0.1)
            }),
            (Field::StartOutputScales, |contents| {
                init_net_mut(contents).output_scales.truncate(6)
            }),
        ],
    );
    let mut contents = small(ModelKind::Phong);
    descent_mut(&mut contents).model = ModelKind::Linear;
    assert_eq!(contents.write(), Err(RecipeError::Model(ModelKind::Linear)));
}

/// Components at the sampled directions and a basis belong to Linear. They are unused next to an init net.
#[test]
fn init_net_excludes_linear_components() {
    assert_rejected(
        &ALL[1..],
        RecipeError::Unused,
        &[
            (Field::Rows, |contents| contents.rows = vec![1; 24]),
            (Field::RowScales, |contents| {
                contents.row_scales = vec![0.1; 4]
            }),
            (Field::BasisChecksum, |contents| contents.basis_checksum = 1),
        ],
    );
    let text = RecipeError::Unused(Field::Rows).to_string();
    for part in [Field::Rows.name(), &Kind::START.to_string()] {
        assert!(text.contains(part), "{text}");
    }
    // Reading rejects such recipes of other writers.
    let mut sections = sections(ModelKind::Phong);
    // The last field is the checksum, a 0 of one byte.
    let last = section_mut(&mut sections, Kind::COMPLETION).last_mut();
    assert_eq!(std::mem::replace(last.unwrap(), 1), 0);
    let error = RecipeError::Unused(Field::BasisChecksum);
    assert_eq!(parse_error(&recipe_with(&sections)), error);
}

#[test]
fn accepts_largest_counts() {
    for (components, hidden) in [(1, MAX_ROWS - 1), (MAX_ROWS, 0)] {
        for model in [ModelKind::Linear, ModelKind::Phong] {
            let shape = [SAMPLES, components, hidden, MAX_UNITS];
            let contents = CompletedContents::new(model, shape, MissingPolicy::Scaled);
            assert!(contents.write().is_ok(), "{model}");
        }
    }
}

#[test]
fn rejects_non_finite_numbers() {
    assert_rejected(
        &ALL,
        RecipeError::NonFinite,
        &[
            (Field::Center, |contents| contents.center[5] = f32::NAN),
            (Field::Scale, |contents| contents.scale = f32::INFINITY),
            (Field::ReadingScales, |contents| {
                contents.reading_scales[8] = f32::NAN
            }),
            (Field::Bias, |contents| contents.bias[8] = f32::NEG_INFINITY),
            (Field::OutputScales, |contents| {
                contents.output_scales[3] = f32::NAN
            }),
        ],
    );
    assert_rejected(
        &LINEAR,
        RecipeError::NonFinite,
        &[(Field::RowScales, |contents| {
            contents.row_scales[3] = f32::NAN
        })],
    );
    assert_rejected(
        &PHONG,
        RecipeError::NonFinite,
        &[
            (Field::Initial, |contents| {
                descent_mut(contents).initial[6] = f32::NAN
            }),
            (Field::StepSizes, |contents| {
                descent_mut(contents).step_sizes[0] = f32::INFINITY
            }),
            (Field::StartBias, |contents| {
                init_net_mut(contents).bias[2] = f32::NAN
            }),
            (Field::StartHiddenScales, |contents| {
                init_net_mut(contents).hidden_scales[2] = f32::INFINITY
            }),
            (Field::StartOutputScales, |contents| {
                init_net_mut(contents).output_scales[6] = f32::NAN
            }),
        ],
    );
}

#[test]
fn rejects_numbers_out_of_range() {
    assert_rejected(
        &ALL,
        RecipeError::NotPositive,
        &[
            (Field::Scale, |contents| contents.scale = 0.0),
            (Field::Scale, |contents| contents.scale = -1.0),
        ],
    );
    assert_rejected(
        &ALL,
        RecipeError::Range,
        &[
            (Field::Center, |contents| contents.center[0] = 100.1),
            (Field::Center, |contents| contents.center[0] = -100.1),
            (Field::Missing, |contents| contents.missing = 3),
        ],
    );
    // A row's scale may have either sign, and may be 0.
    let mut contents = small(ModelKind::Phong);
    contents.reading_scales.fill(0.0);
    contents.output_scales.fill(-1.0);
    assert!(contents.write().is_ok());
}

/// The sections of a valid recipe.
fn sections(model: ModelKind) -> Sections {
    sections_of(&small(model).write().unwrap())
}

#[test]
fn names_missing_and_extra_sections() {
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
        // A completion for an init net has no components of Linear.
        (&[completion], RecipeError::Count(Field::Rows)),
    ] {
        assert_eq!(parse_error(&recipe_with(&phong(kinds))), error, "{kinds:?}");
    }

    // A ridge excludes other methods. An init net next to it is not a second method.
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
        assert_eq!(parse_error(&recipe_with(&sections)), error, "{others:?}");
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

/// A recipe with a cut body and a matching header is valid only if the cut is between sections and the remaining
/// sections suffice.
#[test]
fn rejects_cut_body() {
    let [linear, phong] = [ModelKind::Linear, ModelKind::Phong].map(small);
    for (contents, last) in [
        (linear.clone(), &[Kind::COMPLETION][..]),
        (linear.corrected(CORRECTED), &[Kind::CORRECTION]),
        // The section of the descent alone is sufficient, too.
        (phong.clone(), &[Kind::DESCENT, Kind::START]),
        (phong.clone().stepped(), &[Kind::GAUSS_NEWTON]),
        (phong.corrected(CORRECTED).stepped(), &[Kind::CORRECTION]),
    ] {
        let bytes = contents.write().unwrap();
        let sections = sections_of(&bytes);
        let body = body_of(&sections);
        assert_eq!(body, bytes[HEADER_BYTES..]);
        let valid_lengths: Vec<usize> = last
            .iter()
            .map(|last| {
                let end = sections.iter().position(|(kind, _)| kind == last).unwrap();
                body_of(&sections[..=end]).len()
            })
            .collect();
        for length in 0..body.len() {
            let is_valid = Recipe::parse(&with_header(VERSION, &body[..length])).is_ok();
            assert_eq!(is_valid, valid_lengths.contains(&length), "{length}");
        }
    }
}

/// A recipe with a changed byte and a matching header is either rejected or valid, so that it can be copied.
#[test]
fn altered_bytes_are_rejected_or_valid() {
    let [linear, phong] = [ModelKind::Linear, ModelKind::Phong].map(small);
    let corrected = [linear.clone(), phong.clone()].map(|each| each.corrected(CORRECTED));
    let [corrected_linear, corrected_phong] = corrected;
    for contents in [linear, phong, corrected_linear, corrected_phong.stepped()] {
        let mut body = body_of(&sections_of(&contents.write().unwrap()));
        for index in 0..body.len() {
            let before = body[index];
            for after in [0, 0x7F, 0x80, 0xFF, before ^ 1] {
                body[index] = after;
                let bytes = with_header(VERSION, &body);
                if let Ok(recipe) = Recipe::parse(&bytes) {
                    assert_eq!(memory_words(&[&bytes]), recipe.memory_words());
                    let mut buffer = vec![0; bytes.len()];
                    assert_eq!(recipe.copy_without(&[], &mut buffer), Ok(&bytes[..]));
                }
            }
            body[index] = before;
        }
    }
}
