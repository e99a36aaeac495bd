//! What is no recipe that completes readings is refused, by the name of what is wrong.

use glimpse_core::fit::completion::Missing;
use glimpse_core::fit::{MAX_ROWS, MAX_UNITS};
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{Field, HEADER_BYTES, Kind, Recipe, RecipeError, VERSION};

use super::forged::sealed;
use super::made::{Descends, Made, SMALL, Shape, Starts};

/// A change to what is there, and the field that it is refused by.
type Change<T> = (Field, fn(&mut T));

fn refused(model: ModelKind, change: impl Fn(&mut Made)) -> RecipeError {
    let mut made = Made::small(model, Missing::CountForMore);
    change(&mut made);
    made.write().unwrap_err()
}

/// In a completion, whatever follows it.
fn in_completion(change: fn(&mut Made)) -> RecipeError {
    let [error, others @ ..] = [ModelKind::Linear, ModelKind::Phong, ModelKind::Neural]
        .map(|model| refused(model, change));
    assert_eq!(others, [error; 2]);
    error
}

fn in_linear(change: fn(&mut Made)) -> RecipeError {
    refused(ModelKind::Linear, change)
}

fn in_descent(change: fn(&mut Descends)) -> RecipeError {
    refused(ModelKind::Phong, |made| {
        change(&mut made.then.as_mut().unwrap().0)
    })
}

fn in_start(change: fn(&mut Starts)) -> RecipeError {
    refused(ModelKind::Phong, |made| {
        change(&mut made.then.as_mut().unwrap().1)
    })
}

#[test]
fn wrong_counts_are_refused() {
    let completions: [Change<Made>; 17] = [
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
        (Field::Centre, |made| made.centre.push(0.1)),
        (Field::Centre, |made| made.centre.truncate(5)),
        (Field::Centre, |made| made.centre.clear()),
    ];
    for (field, change) in completions {
        assert_eq!(in_completion(change), RecipeError::Count(field));
    }
    let linear: [Change<Made>; 4] = [
        (Field::Rows, |made| made.rows.push(1)),
        (Field::Rows, |made| made.rows.clear()),
        (Field::RowScales, |made| made.row_scales.push(0.1)),
        (Field::RowScales, |made| made.row_scales.clear()),
    ];
    for (field, change) in linear {
        assert_eq!(in_linear(change), RecipeError::Count(field));
    }
    let descents: [Change<Descends>; 4] = [
        (Field::InnerSteps, |descends| descends.inner_steps = 0),
        (Field::Initial, |descends| descends.initial.push(0.1)),
        (Field::StepSizes, |descends| descends.step_sizes.truncate(6)),
        (Field::Initial, |descends| {
            descends.model = ModelKind::Neural
        }),
    ];
    for (field, change) in descents {
        assert_eq!(in_descent(change), RecipeError::Count(field));
    }
    let starts: [Change<Starts>; 9] = [
        (Field::StartBias, |starts| starts.bias.clear()),
        (Field::StartBias, |starts| {
            starts.bias = vec![0.5; MAX_UNITS + 1]
        }),
        (Field::StartHidden, |starts| starts.bias.push(0.1)),
        (Field::StartHidden, |starts| starts.hidden.push(1)),
        (Field::StartHidden, |starts| starts.hidden.clear()),
        (Field::StartHiddenScales, |starts| {
            starts.hidden_scales.push(0.1)
        }),
        (Field::StartOutput, |starts| starts.output.truncate(20)),
        (Field::StartOutputScales, |starts| {
            starts.output_scales.push(0.1)
        }),
        (Field::StartOutputScales, |starts| {
            starts.output_scales.truncate(6)
        }),
    ];
    for (field, change) in starts {
        assert_eq!(in_start(change), RecipeError::Count(field));
    }
    let error = in_descent(|descends| descends.model = ModelKind::Linear);
    assert_eq!(error, RecipeError::Model(ModelKind::Linear));
}

/// Components at the sampled directions, and a basis, are Linear's: with a start they would have no
/// meaning.
#[test]
fn a_start_has_no_components_beside_it() {
    let changes: [Change<Made>; 3] = [
        (Field::Rows, |made| made.rows = vec![1; 24]),
        (Field::RowScales, |made| made.row_scales = vec![0.1; 4]),
        (Field::BasisChecksum, |made| made.basis_checksum = 1),
    ];
    for model in [ModelKind::Phong, ModelKind::CookTorrance, ModelKind::Neural] {
        for (field, change) in changes {
            let error = refused(model, change);
            assert_eq!(error, RecipeError::Unused(field));
            let message = error.to_string();
            assert!(message.contains(field.name()), "{message}");
            assert!(message.contains(&Kind::START.to_string()), "{message}");
        }
    }
}

/// What is written without a check, as others may write it, is refused when it is read.
#[test]
fn a_basis_beside_a_start_is_refused_when_it_is_read() {
    let mut sections = sections(ModelKind::Phong);
    let section = sections
        .iter_mut()
        .find(|(kind, _)| *kind == Kind::COMPLETION);
    // Its checksum comes last, and is a 0 of one byte.
    let last = section.unwrap().1.last_mut().unwrap();
    assert_eq!(*last, 0);
    *last = 1;
    let bytes = sealed(VERSION, &body(&sections));
    let error = Recipe::parse(&bytes).map(drop).unwrap_err();
    assert_eq!(error, RecipeError::Unused(Field::BasisChecksum));
}

#[test]
fn the_largest_counts_are_not_refused() {
    for (components, hidden) in [(1, MAX_ROWS - 1), (MAX_ROWS, 0)] {
        let shape = Shape {
            components,
            hidden,
            units: MAX_UNITS,
            ..SMALL
        };
        for model in [ModelKind::Linear, ModelKind::Phong] {
            assert!(
                Made::new(model, shape, Missing::CountForMore)
                    .write()
                    .is_ok()
            );
        }
    }
}

#[test]
fn numbers_that_are_not_finite_are_refused() {
    let completions: [Change<Made>; 5] = [
        (Field::Centre, |made| made.centre[5] = f32::NAN),
        (Field::Scale, |made| made.scale = f32::INFINITY),
        (Field::ReadingScales, |made| {
            made.reading_scales[8] = f32::NAN
        }),
        (Field::Bias, |made| made.bias[8] = f32::NEG_INFINITY),
        (Field::OutputScales, |made| made.output_scales[3] = f32::NAN),
    ];
    for (field, change) in completions {
        assert_eq!(in_completion(change), RecipeError::NonFinite(field));
    }
    let error = in_linear(|made| made.row_scales[3] = f32::NAN);
    assert_eq!(error, RecipeError::NonFinite(Field::RowScales));
    let descents: [Change<Descends>; 2] = [
        (Field::Initial, |descends| descends.initial[6] = f32::NAN),
        (Field::StepSizes, |descends| {
            descends.step_sizes[0] = f32::INFINITY
        }),
    ];
    for (field, change) in descents {
        assert_eq!(in_descent(change), RecipeError::NonFinite(field));
    }
    let starts: [Change<Starts>; 3] = [
        (Field::StartBias, |starts| starts.bias[2] = f32::NAN),
        (Field::StartHiddenScales, |starts| {
            starts.hidden_scales[2] = f32::INFINITY
        }),
        (Field::StartOutputScales, |starts| {
            starts.output_scales[6] = f32::NAN
        }),
    ];
    for (field, change) in starts {
        assert_eq!(in_start(change), RecipeError::NonFinite(field));
    }
}

#[test]
fn numbers_out_of_their_range_are_refused() {
    let scales: [fn(&mut Made); 2] = [|made| made.scale = 0.0, |made| made.scale = -1.0];
    for change in scales {
        let error = in_completion(change);
        assert_eq!(error, RecipeError::NotPositive(Field::Scale));
    }
    let centres: [fn(&mut Made); 2] = [
        |made| made.centre[0] = 100.1,
        |made| made.centre[0] = -100.1,
    ];
    for change in centres {
        assert_eq!(in_completion(change), RecipeError::Range(Field::Centre));
    }
    let missing = in_completion(|made| made.missing = 3);
    assert_eq!(missing, RecipeError::Range(Field::Missing));
    // Scales of a row may be of either sign, and 0 for a row that says nothing.
    let mut made = Made::small(ModelKind::Phong, Missing::CountForMore);
    made.reading_scales.fill(0.0);
    made.output_scales.fill(-1.0);
    assert!(made.write().is_ok());
}

/// A recipe's sections.
fn sections(model: ModelKind) -> Vec<(Kind, Vec<u8>)> {
    let bytes = Made::small(model, Missing::CountForMore).write().unwrap();
    let sections = Recipe::parse(&bytes).unwrap().sections();
    sections
        .map(|(kind, bytes)| (kind, bytes.to_vec()))
        .collect()
}

/// Sections as a recipe's body.
fn body(sections: &[(Kind, Vec<u8>)]) -> Vec<u8> {
    let mut body = Vec::new();
    for (kind, bytes) in sections {
        for mut number in [usize::from(kind.number()), bytes.len()] {
            while number >= 0x80 {
                body.push(number as u8 | 0x80);
                number >>= 7;
            }
            body.push(number as u8);
        }
        body.extend(bytes);
    }
    body
}

#[test]
fn a_companion_that_is_missing_or_too_many_is_named() {
    let of = |model: ModelKind, kinds: &[Kind]| {
        let mut sections = sections(model);
        sections.retain(|(kind, _)| kinds.contains(kind));
        sections
    };
    let refused = |sections: &[(Kind, Vec<u8>)]| {
        let bytes = sealed(VERSION, &body(sections));
        Recipe::parse(&bytes).map(drop).unwrap_err()
    };
    let phong = |kinds: &[Kind]| {
        let kinds = [&[Kind::PATTERN], kinds].concat();
        refused(&of(ModelKind::Phong, &kinds))
    };
    let (descent, completion, start) = (Kind::DESCENT, Kind::COMPLETION, Kind::START);
    assert_eq!(phong(&[]), RecipeError::Learners(0));
    assert_eq!(phong(&[completion, start]), RecipeError::Missing(descent));
    assert_eq!(phong(&[descent, start]), RecipeError::Missing(completion));
    assert_eq!(phong(&[descent, completion]), RecipeError::Missing(start));
    assert_eq!(phong(&[start]), RecipeError::Missing(descent));
    // A completion that was written for a start has no components of Linear.
    assert_eq!(phong(&[completion]), RecipeError::Count(Field::Rows));

    // A ridge is by itself; a start beside it is no second learner.
    let (learners, beside) = (RecipeError::Learners(2), RecipeError::Beside(start));
    for (others, error) in [
        (&[completion][..], learners),
        (&[start], beside),
        (&[descent], learners),
        (&[descent, start], learners),
        (&[completion, start], learners),
        (&[descent, completion, start], learners),
    ] {
        let kinds = [&[Kind::PATTERN], others].concat();
        let mut sections = of(ModelKind::Phong, &kinds);
        let place = sections
            .iter()
            .filter(|(kind, _)| *kind < Kind::RIDGE)
            .count();
        let lists: [&[u8]; 7] = [&[1], &[0], &[0], &[0], &[0], &[0], &[0]];
        sections.insert(place, (Kind::RIDGE, lists.concat()));
        assert_eq!(refused(&sections), error);
    }
    for (error, kind) in [
        (beside, start),
        (beside, Kind::RIDGE),
        (phong(&[completion, start]), descent),
    ] {
        let message = error.to_string();
        assert!(message.contains(&kind.to_string()), "{message}");
    }
}

#[test]
fn sections_of_the_wrong_bytes_are_named() {
    let changes: [fn(&mut Vec<u8>); 3] = [
        |bytes| bytes.push(0),
        |bytes| bytes.truncate(bytes.len() - 1),
        Vec::clear,
    ];
    for kind in [Kind::COMPLETION, Kind::START] {
        for change in changes {
            let mut sections = sections(ModelKind::Phong);
            let section = sections.iter_mut().find(|(found, _)| *found == kind);
            change(&mut section.unwrap().1);
            let bytes = sealed(VERSION, &body(&sections));
            let error = Recipe::parse(&bytes).map(drop).unwrap_err();
            assert_eq!(error, RecipeError::Section(kind));
        }
    }
}

/// Of a recipe that was cut nothing is read; of one that was cut and sealed again, whole sections.
#[test]
fn truncations_are_refused() {
    for model in [ModelKind::Linear, ModelKind::Phong] {
        let bytes = Made::small(model, Missing::CountForMore).write().unwrap();
        for length in 0..bytes.len() {
            let error = Recipe::parse(&bytes[..length]).map(drop).unwrap_err();
            let is_named = matches!(error, RecipeError::Magic | RecipeError::Length { .. });
            assert!(is_named, "{length}: {error}");
        }
        let all = body(&sections(model));
        assert_eq!(all, bytes[HEADER_BYTES..]);
        // A recipe ends with its last required section, and so does the descent that it holds.
        let ends_with = |last: Kind| {
            let mut sections = sections(model);
            sections.retain(|(kind, _)| *kind <= last);
            body(&sections).len()
        };
        let whole = match model {
            ModelKind::Linear => vec![ends_with(Kind::COMPLETION)],
            _ => vec![ends_with(Kind::DESCENT), ends_with(Kind::START)],
        };
        for length in 0..all.len() {
            let cut = sealed(VERSION, &all[..length]);
            let is_read = Recipe::parse(&cut).is_ok();
            assert_eq!(is_read, whole.contains(&length), "{length}");
        }
    }
}

/// Whatever a byte is changed to, the recipe is refused or can be scanned by and copied.
#[test]
fn altered_bytes_are_refused_or_harmless() {
    for model in [ModelKind::Linear, ModelKind::Phong] {
        let mut all = body(&sections(model));
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
