//! Only intact recipes are read. Other bytes are rejected with an error that names their fault.

use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{Field, HEADER_BYTES, Recipe, RecipeError, VERSION};
use proptest::prelude::*;

use crate::recipes::{
    DescentContents, RidgeContents, linear, neural, parse_error, parsed, with_header,
};
use crate::scanning::{MODELS, encoded_recipe};

/// The result of writing a descent after a change.
fn write_changed(change: impl FnOnce(&mut DescentContents)) -> Result<(), RecipeError> {
    let mut contents = neural();
    change(&mut contents);
    contents.write().map(drop)
}

#[test]
fn descent_round_trip() {
    for (model, parameters) in [
        (ModelKind::Phong, 7),
        (ModelKind::CookTorrance, 8),
        (ModelKind::Neural, 675),
    ] {
        let mut contents = neural();
        contents.model = model;
        contents.initial.truncate(parameters);
        contents.step_sizes.truncate(parameters);
        let recipe = parsed(contents.write().unwrap());
        assert_eq!(recipe.model(), model);
        assert_eq!(recipe.samples(), 8);
        assert_eq!(recipe.expected_loss(), Some(0.03));
        assert!(recipe.ridge().is_none());
        let descent = recipe.descent().unwrap();
        assert_eq!(descent.model(), model);
        assert_eq!(descent.inner_steps(), 20);
        assert!(descent.initial().iter().eq(contents.initial));
        assert!(descent.step_sizes().iter().eq(contents.step_sizes));
        let angles = recipe
            .pattern()
            .flat_map(|a| [a.theta_h, a.theta_d, a.phi_d]);
        assert!(angles.eq(contents.pattern));
        let directions = recipe.pattern().map(|angles| {
            let at = HalfDifference::from_angles(angles);
            at.directions()
        });
        assert!(recipe.directions().eq((0..).zip(directions)));
    }
}

#[test]
fn ridge_round_trip() {
    for (written, read) in [(0xfeed_beef, Some(0xfeed_beef)), (0, None)] {
        let contents = RidgeContents {
            basis_checksum: written,
            ..linear()
        };
        let recipe = parsed(contents.write().unwrap());
        assert_eq!(recipe.model(), ModelKind::Linear);
        assert_eq!(recipe.samples(), 8);
        assert_eq!(recipe.expected_loss(), Some(0.03));
        assert!(recipe.descent().is_none());
        let ridge = recipe.ridge().unwrap();
        assert_eq!(ridge.components(), 5);
        assert_eq!(ridge.problem().samples(), 8);
        assert_eq!(ridge.problem().components(), 5);
        assert!(ridge.basis().iter().eq(contents.basis));
        assert!(ridge.mean().iter().eq(contents.mean));
        assert!(ridge.median().iter().eq(contents.median));
        assert!(ridge.weight().iter().eq(contents.weight));
        assert!(ridge.precision().iter().eq(contents.precision));
        assert_eq!(ridge.basis_checksum(), read);
    }
}

#[test]
fn rejects_any_flipped_bit() {
    for model in MODELS {
        let mut bytes = encoded_recipe(model);
        for index in 0..bytes.len() {
            for bit in 0..8 {
                bytes[index] ^= 1 << bit;
                let error = parse_error(&bytes);
                let is_named = match index {
                    0..4 => error == RecipeError::Magic,
                    4..6 => matches!(error, RecipeError::Version(version) if version != VERSION),
                    6..10 => matches!(error, RecipeError::Length { .. }),
                    _ => error == RecipeError::Checksum,
                };
                assert!(is_named, "byte {index}, bit {bit}: {error}");
                bytes[index] ^= 1 << bit;
            }
        }
    }
}

#[test]
fn rejects_any_truncation_or_padding() {
    for model in MODELS {
        let whole = encoded_recipe(model);
        let padded = [&whole[..], &[0]].concat();
        for length in (0..whole.len()).chain([padded.len()]) {
            let expected = if length < HEADER_BYTES {
                HEADER_BYTES
            } else {
                whole.len()
            };
            let (expected, found) = (expected as u32, length as u32);
            let error = match length {
                0..4 => RecipeError::Magic,
                _ => RecipeError::Length { expected, found },
            };
            assert_eq!(parse_error(&padded[..length]), error, "{length} bytes");
        }
    }
}

#[test]
fn rejects_other_format_versions() {
    let whole = encoded_recipe(ModelKind::Neural);
    assert_eq!(with_header(VERSION, &whole[HEADER_BYTES..]), whole);
    for version in [0, 1, 2, VERSION + 1, u16::MAX] {
        for body in [&whole[HEADER_BYTES..], &[]] {
            let error = RecipeError::Version(version);
            assert_eq!(parse_error(&with_header(version, body)), error);
        }
    }
}

/// A change of the model changes the number of parameters.
#[test]
fn rejects_descent_of_other_model() {
    for (model, error) in [
        (ModelKind::Phong, RecipeError::Count(Field::Initial)),
        (ModelKind::Linear, RecipeError::Model(ModelKind::Linear)),
    ] {
        assert_eq!(write_changed(|n| n.model = model), Err(error));
    }
}

#[test]
fn accepts_whole_turns() {
    let turned = write_changed(|n| n.pattern[2] += 100.0 * std::f32::consts::TAU);
    assert_eq!(turned, Ok(()));
}

proptest! {
    #[test]
    fn rejects_body_of_noise(
        noise in prop::collection::vec(any::<u8>(), 0..200),
    ) {
        let error = parse_error(&with_header(VERSION, &noise));
        let of_header = matches!(error, RecipeError::Checksum | RecipeError::Length { .. });
        prop_assert!(!of_header, "{}", error);
    }

    #[test]
    fn rejects_noise(noise in prop::collection::vec(any::<u8>(), 0..200)) {
        prop_assert!(Recipe::parse(&noise).is_err());
    }
}
