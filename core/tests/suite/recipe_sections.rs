//! The sections of a recipe: each is read, skipped or rejected, depending on its kind.

use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{
    HEADER_BYTES, Kind, PackedDescent, PackedMethod, Recipe, RecipeError, RecipeParts, VERSION,
};
use proptest::prelude::*;

use crate::completion::partial::all_small;
use crate::recipes::{
    Sections, linear, packed, parsed, recipe_with, section_mut, sections_of, with_header, write,
};
use crate::scanning::{encoded_recipe, recipe_for};

const METADATA: &[u8] = b"bytes of the trainer";

/// A recipe of the model Phong with all sections that a descent may have.
fn full_parts() -> RecipeParts<'static> {
    let ones: &'static [u8] = packed(&[1.0; 7]).leak();
    RecipeParts {
        pattern: &[0; 24],
        method: PackedMethod::Descent(PackedDescent {
            model: ModelKind::Phong,
            inner_steps: 20,
            initial: ones,
            step_sizes: ones,
        }),
        expected_loss: Some(0.0125),
        prediction: None,
        uncertainty: None,
        is_in_path_order: true,
        partial: None,
        metadata: METADATA,
    }
}

pub(crate) fn full_sections() -> Sections {
    sections_of(&write(&full_parts()).unwrap())
}

/// The error of a recipe with these sections.
fn parse_error(sections: &Sections) -> RecipeError {
    Recipe::parse(&recipe_with(sections)).map(drop).unwrap_err()
}

#[test]
fn section_round_trip() {
    let bytes = write(&full_parts()).unwrap();
    let recipe = Recipe::parse(&bytes).unwrap();
    assert_eq!(recipe.expected_loss(), Some(0.0125));
    assert!(recipe.is_in_path_order());
    assert_eq!(recipe.metadata(), METADATA);
    let kinds: Vec<u16> = recipe.sections().map(|(kind, _)| kind.number()).collect();
    assert_eq!(kinds, [0, 1, 130, 136, 138]);
    // The test's own writer gives the same bytes.
    assert_eq!(recipe_with(&full_sections()), bytes);
}

#[test]
fn optional_sections_may_be_missing() {
    let bytes = write(&RecipeParts::new(full_parts().pattern, full_parts().method)).unwrap();
    assert_eq!(sections_of(&bytes).len(), 2);
    let recipe = parsed(bytes);
    assert_eq!(recipe.expected_loss(), None);
    assert!(!recipe.is_in_path_order());
    assert!(recipe.metadata().is_empty());
}

#[test]
fn names_missing_required_section() {
    let without = |kind| {
        let mut sections = full_sections();
        sections.retain(|(other, _)| *other != kind);
        parse_error(&sections)
    };
    let missing = without(Kind::PATTERN);
    assert_eq!(missing, RecipeError::Missing(Kind::PATTERN));
    assert_eq!(without(Kind::DESCENT), RecipeError::Learners(0));
    let error = RecipeError::Missing(Kind::PATTERN);
    assert_eq!(parse_error(&Vec::new()), error);

    let mut both = full_sections();
    let ridge = sections_of(&linear().write().unwrap()).swap_remove(1);
    assert_eq!(ridge.0, Kind::RIDGE);
    both.insert(2, ridge);
    let error = parse_error(&both);
    assert_eq!(error, RecipeError::Learners(2));
}

#[test]
fn skips_or_rejects_unknown_kinds() {
    let mut sections = full_sections();
    sections.push((Kind::new(139), b"from the future".to_vec()));
    sections.push((Kind::new(u16::MAX), Vec::new()));
    let recipe = parsed(recipe_with(&sections));
    assert_eq!(recipe.metadata(), METADATA);
    let unknown = (Kind::new(139), &b"from the future"[..]);
    assert!(recipe.sections().any(|section| section == unknown));
    assert_eq!(Kind::new(139).name(), None);

    for kind in [7, 127].map(Kind::new) {
        let mut sections = sections.clone();
        sections.insert(2, (kind, Vec::new()));
        let error = parse_error(&sections);
        assert_eq!(error, RecipeError::Unknown(kind));
        let error = Error::from(error);
        assert_eq!(error.code, ErrorCode::RecipeUnknown);
        assert_eq!(error.details, [kind.number().into(), 0]);
    }
    assert!(Kind::new(127).is_required() && !Kind::new(128).is_required());
}

#[test]
fn rejects_duplicate_or_unordered_kinds() {
    let mut all = full_sections();
    all.push((Kind::new(200), Vec::new()));
    for index in 0..all.len() {
        let error = RecipeError::Order(all[index].0);
        for place in [index, all.len()] {
            let mut twice = all.clone();
            twice.insert(place, all[index].clone());
            assert_eq!(parse_error(&twice), error);
        }
        if index + 1 < all.len() {
            let mut swapped = all.clone();
            swapped.swap(index, index + 1);
            assert_eq!(parse_error(&swapped), error);
        }
    }
}

#[test]
fn rejects_cut_or_padded_section() {
    let completed = all_small().map(|contents| sections_of(&contents.write()));
    for all in completed.chain([full_sections()]) {
        let is_checked = |(kind, _): &(Kind, Vec<u8>)| {
            ![Kind::EXPECTATION, Kind::PATH_ORDER, Kind::METADATA].contains(kind)
        };
        for index in (0..all.len()).filter(|index| is_checked(&all[*index])) {
            let error = RecipeError::Section(all[index].0);
            for length in 0..all[index].1.len() {
                let mut cut = all.clone();
                cut[index].1.truncate(length);
                assert_eq!(parse_error(&cut), error, "{length}");
            }
            let mut padded = all.clone();
            padded[index].1.push(0);
            assert_eq!(parse_error(&padded), error);
        }
    }
}

#[test]
fn body_ending_within_section_is_malformed() {
    let whole = write(&full_parts()).unwrap();
    let body = &whole[HEADER_BYTES..];
    for tail in [&[0x80][..], &[0xFF, 0xFF, 0xFF], &[0xC8, 0x01, 5, 1, 2]] {
        let bytes = with_header(VERSION, &[body, tail].concat());
        assert_eq!(Recipe::parse(&bytes).err(), Some(RecipeError::Malformed));
    }
    let bytes = with_header(VERSION, &body[..body.len() - 1]);
    assert_eq!(Recipe::parse(&bytes).err(), Some(RecipeError::Malformed));
}

/// A scan does not need the expected loss.
#[test]
fn invalid_expected_loss_is_ignored() {
    for loss in [&[][..], &f32::NAN.to_le_bytes(), &(-1_f32).to_le_bytes()] {
        let mut sections = full_sections();
        *section_mut(&mut sections, Kind::EXPECTATION) = loss.to_vec();
        assert_eq!(parsed(recipe_with(&sections)).expected_loss(), None);
    }
}

#[test]
fn copy_omits_only_named_sections() {
    let mut sections = full_sections();
    sections.push((Kind::new(1000), b"unknown".to_vec()));
    let bytes = recipe_with(&sections);
    let recipe = Recipe::parse(&bytes).unwrap();
    let copy = |kinds: &[Kind]| {
        let mut buffer = vec![0; bytes.len()];
        let copy = recipe.copy_without(kinds, &mut buffer);
        copy.map(<[u8]>::to_vec)
    };
    let optional = [130, 136, 138, 1000].map(Kind::new);
    for kind in optional {
        let copied = copy(&[kind]).unwrap();
        let mut expected = sections.clone();
        expected.retain(|(other, _)| *other != kind);
        assert_eq!(sections_of(&copied), expected);
    }
    assert_eq!(sections_of(&copy(&optional).unwrap()), sections[..2]);
    // A section that the recipe lacks is ignored.
    assert_eq!(copy(&[Kind::new(999)]).unwrap(), bytes);
    assert_eq!(copy(&[]).unwrap(), bytes);
    for kind in [Kind::PATTERN, Kind::DESCENT, Kind::RIDGE, Kind::new(7)] {
        let error = copy(&[Kind::METADATA, kind]).unwrap_err();
        assert_eq!(error, RecipeError::Required(kind));
    }
    for length in 0..bytes.len() {
        let error = recipe.copy_without(&[], &mut vec![0; length]).unwrap_err();
        assert_eq!(error, RecipeError::BufferTooSmall);
    }
}

#[test]
fn rejects_small_buffer() {
    let linear = recipe_for(ModelKind::Linear);
    let pattern = vec![0; 12 * linear.samples()];
    let ridge = RecipeParts::new(&pattern, linear.method().into());
    for parts in [full_parts(), ridge] {
        let whole = write(&parts).unwrap();
        for length in 0..whole.len() {
            let error = Recipe::write(&parts, &mut vec![0; length]).unwrap_err();
            assert_eq!(error, RecipeError::BufferTooSmall);
        }
        assert!(Recipe::write(&parts, &mut vec![0; whole.len()]).is_ok());
    }
}

proptest! {
    #[test]
    fn noise_section_is_rejected_or_valid(
        which in 0..5usize,
        noise in prop::collection::vec(any::<u8>(), 0..80),
    ) {
        let mut sections = full_sections();
        sections[which].1 = noise;
        let bytes = recipe_with(&sections);
        match Recipe::parse(&bytes) {
            Ok(recipe) => {
                let mut buffer = vec![0; bytes.len()];
                prop_assert_eq!(recipe.copy_without(&[], &mut buffer).unwrap(), &bytes[..]);
            }
            Err(error) => {
                let of_body = !matches!(error, RecipeError::Checksum | RecipeError::Malformed);
                prop_assert!(of_body, "{}", error);
            }
        }
    }
}

/// A recipe of a realistic size is not much longer than its numbers.
#[test]
fn sections_add_few_bytes() {
    let bytes = encoded_recipe(ModelKind::Neural);
    let numbers = 4 * (24 + 2 * 675);
    assert!(bytes.len() < numbers + 100, "{}", bytes.len());
}
