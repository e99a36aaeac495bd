//! Recipes of missing, extra, cut and altered sections.

use glimpse_core::fit::coefficient_net::MissingPolicy;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{Field, HEADER_BYTES, Kind, Recipe, RecipeError, VERSION, memory_words};

use super::contents::{CORRECTED, CompletedContents};
use crate::recipes::{body_of, linear, parse_error, recipe_with, sections_of, with_header};

fn small(model: ModelKind) -> CompletedContents {
    CompletedContents::small(model, MissingPolicy::Scaled)
}

#[test]
fn names_missing_and_extra_sections() {
    // All kinds from 0 to 6. The completion is that of a recipe with an init net.
    let phong = small(ModelKind::Phong);
    let steps = phong.clone().corrected(CORRECTED).stepped();
    let recipes = [phong.write(), linear().write().unwrap(), steps.write()];
    let mut all = recipes.map(|bytes| sections_of(&bytes)).concat();
    all.sort();
    all.dedup_by_key(|(kind, _)| *kind);
    let (missing, beside) = (RecipeError::Missing, RecipeError::Beside);
    for (error, combinations) in [
        (RecipeError::Learners(0), &[""][..]),
        (missing(Kind::DESCENT), &["4", "34", "346"]),
        (
            missing(Kind::COMPLETION),
            &["5", "6", "14", "16", "26", "45", "456"],
        ),
        (missing(Kind::START), &["13", "35", "356"]),
        // An init net or steps next to a ridge are not a second method.
        (beside(Kind::START), &["24", "245"]),
        (beside(Kind::GAUSS_NEWTON), &["25"]),
        (
            RecipeError::Learners(2),
            &[
                "12", "15", "23", "124", "125", "135", "145", "234", "236", "1234", "1345", "2345",
            ],
        ),
        (RecipeError::Count(Field::Rows), &["3"]),
    ] {
        for kinds in combinations {
            let mut sections = all.clone();
            sections.retain(|(kind, _)| {
                *kind == Kind::PATTERN || kinds.contains(&kind.number().to_string())
            });
            assert_eq!(sections.len(), kinds.len() + 1);
            assert_eq!(parse_error(&recipe_with(&sections)), error, "{kinds}");
        }
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
        let bytes = contents.write();
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
        let mut body = body_of(&sections_of(&contents.write()));
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
