//! Only intact recipes are read. Other bytes are rejected with an error that names their fault.

use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{
    Field, HEADER_BYTES, MAX_BASIS, MAX_COMPONENTS, MAX_INNER_STEPS, MAX_MEAN, MAX_MEDIAN,
    MAX_PRECISION, MAX_SAMPLES, MAX_WEIGHT, MIN_PRECISION, Recipe, RecipeError, VERSION,
};
use proptest::prelude::*;

use crate::recipes::{
    Change, DescentContents, RidgeContents, linear, neural, parse_error, parsed, with_header,
};
use crate::scanning::{MODELS, encoded_recipe};

/// The result of writing a descent after a change.
fn write_changed(change: impl FnOnce(&mut DescentContents)) -> Result<(), RecipeError> {
    let mut contents = neural();
    change(&mut contents);
    contents.write().map(drop)
}

/// The result of writing a ridge after a change.
fn write_changed_ridge(change: impl FnOnce(&mut RidgeContents)) -> Result<(), RecipeError> {
    let mut contents = linear();
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
        let provenance = recipe.metadata().unwrap().provenance.unwrap();
        assert_eq!(provenance.trainer, "test");
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

#[test]
fn rejects_wrong_descent_counts() {
    let changes: [Change<Field, DescentContents>; 9] = [
        (Field::InnerSteps, |n| n.inner_steps = 0),
        (Field::InnerSteps, |n| n.inner_steps = MAX_INNER_STEPS + 1),
        (Field::Pattern, |n| n.pattern.clear()),
        (Field::Pattern, |n| n.pattern.push(0.1)),
        (Field::Pattern, |n| {
            n.pattern = vec![0.1; 3 * (MAX_SAMPLES + 1)]
        }),
        (Field::Initial, |n| n.initial.push(0.1)),
        (Field::Initial, |n| n.initial.truncate(674)),
        (Field::StepSizes, |n| n.step_sizes.truncate(1)),
        (Field::Initial, |n| n.model = ModelKind::Phong),
    ];
    for (index, (field, change)) in changes.into_iter().enumerate() {
        let error = RecipeError::Count(field);
        assert_eq!(write_changed(change), Err(error), "change {index}");
    }
    let error = RecipeError::Model(ModelKind::Linear);
    assert_eq!(write_changed(|n| n.model = ModelKind::Linear), Err(error));
}

#[test]
fn rejects_wrong_ridge_counts() {
    let changes: [Change<Field, RidgeContents>; 10] = [
        (Field::Pattern, |n| n.pattern.clear()),
        (Field::Components, |n| n.components = 0),
        (Field::Components, |n| {
            n.components = MAX_COMPONENTS as u16 + 1
        }),
        (Field::Basis, |n| n.components = 4),
        (Field::Basis, |n| n.basis.truncate(39)),
        (Field::Basis, |n| n.basis.push(0.1)),
        (Field::Mean, |n| n.mean.push(0.1)),
        (Field::Median, |n| n.median.truncate(7)),
        (Field::Weight, |n| n.weight.clear()),
        (Field::Precision, |n| n.precision.push(1.0)),
    ];
    for (index, (field, change)) in changes.into_iter().enumerate() {
        let error = RecipeError::Count(field);
        assert_eq!(write_changed_ridge(change), Err(error), "change {index}");
    }
    let largest = write_changed_ridge(|n| {
        n.components = MAX_COMPONENTS as u16;
        n.basis = vec![0.5; 8 * MAX_COMPONENTS];
        n.precision = vec![1.0; MAX_COMPONENTS];
    });
    assert_eq!(largest, Ok(()));
}

#[test]
fn rejects_wrong_ridge_signs() {
    for bad in [0.0, -0.0, -1.0] {
        let error = RecipeError::NotPositive(Field::Weight);
        assert_eq!(write_changed_ridge(|n| n.weight[3] = bad), Err(error));
        let error = RecipeError::NotPositive(Field::Precision);
        assert_eq!(write_changed_ridge(|n| n.precision[4] = bad), Err(error));
    }
    let error = RecipeError::Negative(Field::Median);
    assert_eq!(write_changed_ridge(|n| n.median[7] = -1e-9), Err(error));
    assert_eq!(write_changed_ridge(|n| n.median[7] = 0.0), Ok(()));
}

/// The bounds that a ridge solve in f32 needs.
#[test]
fn rejects_ridge_numbers_out_of_range() {
    type Entry = fn(&mut RidgeContents) -> &mut f32;
    let upper: [(Field, Entry, &[f32]); 5] = [
        (Field::Basis, |n| &mut n.basis[39], &[-MAX_BASIS, MAX_BASIS]),
        (Field::Mean, |n| &mut n.mean[7], &[-MAX_MEAN, MAX_MEAN]),
        (Field::Median, |n| &mut n.median[7], &[MAX_MEDIAN]),
        (Field::Weight, |n| &mut n.weight[7], &[MAX_WEIGHT]),
        (Field::Precision, |n| &mut n.precision[4], &[MAX_PRECISION]),
    ];
    for (field, entry, bounds) in upper {
        for bound in bounds {
            assert_eq!(write_changed_ridge(|n| *entry(n) = *bound), Ok(()));
            for beyond in [bound * (1.0 + f32::EPSILON), f32::MAX.copysign(*bound)] {
                let error = RecipeError::Range(field);
                assert_eq!(write_changed_ridge(|n| *entry(n) = beyond), Err(error));
            }
        }
    }
    let lowest = |precision| write_changed_ridge(|n| n.precision[0] = precision);
    let error = RecipeError::Range(Field::Precision);
    assert_eq!(lowest(MIN_PRECISION), Ok(()));
    assert_eq!(lowest(MIN_PRECISION * (1.0 - f32::EPSILON)), Err(error));
    let text = error.to_string();
    for part in [Field::Precision.name(), "1e-6", "1e8"] {
        assert!(text.contains(part), "no {part} in {text}");
    }
}

#[test]
fn rejects_direction_below_horizon() {
    // With phi_d turned by pi, the other direction is below the horizon.
    for phi_d in [0.0, std::f32::consts::PI] {
        let actual = write_changed(|n| n.pattern[3..6].copy_from_slice(&[1.2, 1.2, phi_d]));
        assert_eq!(actual, Err(RecipeError::BelowHorizon(1)));
    }
}

/// Large angles are rejected, because rounded sines and cosines would not give unit vectors.
#[test]
fn rejects_large_angles() {
    for angle in 0..3 {
        for value in [-1.001e3, 1.001e3, 5e8, 3e9] {
            let error = RecipeError::Range(Field::Pattern);
            assert_eq!(write_changed(|n| n.pattern[angle] = value), Err(error));
        }
    }
    // Whole turns are allowed.
    let turned = write_changed(|n| n.pattern[2] += 100.0 * std::f32::consts::TAU);
    assert_eq!(turned, Ok(()));
}

proptest! {
    #[test]
    fn rejects_non_finite_descent_numbers(
        which in 0..4usize,
        index: prop::sample::Index,
        value in prop::sample::select(vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY]),
    ) {
        let mut contents = neural();
        let (field, list) = match which {
            0 => (Field::Pattern, &mut contents.pattern[..]),
            1 => (Field::Initial, &mut contents.initial[..]),
            2 => (Field::StepSizes, &mut contents.step_sizes[..]),
            _ => (Field::ExpectedLoss, std::slice::from_mut(&mut contents.expected_loss)),
        };
        *index.get_mut(list) = value;
        prop_assert_eq!(contents.write(), Err(RecipeError::NonFinite(field)));
    }

    #[test]
    fn rejects_non_finite_ridge_numbers(
        which in 0..7usize,
        index: prop::sample::Index,
        value in prop::sample::select(vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY]),
    ) {
        let mut contents = linear();
        let (field, list) = match which {
            0 => (Field::Pattern, &mut contents.pattern[..]),
            1 => (Field::Basis, &mut contents.basis[..]),
            2 => (Field::Mean, &mut contents.mean[..]),
            3 => (Field::Median, &mut contents.median[..]),
            4 => (Field::Weight, &mut contents.weight[..]),
            5 => (Field::Precision, &mut contents.precision[..]),
            _ => (Field::ExpectedLoss, std::slice::from_mut(&mut contents.expected_loss)),
        };
        *index.get_mut(list) = value;
        prop_assert_eq!(contents.write(), Err(RecipeError::NonFinite(field)));
    }

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
