//! Only a whole recipe is read; every other input is refused by the name of its fault.

use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{
    Field, HEADER_BYTES, MAX_BASIS, MAX_COMPONENTS, MAX_INNER_STEPS, MAX_MEAN, MAX_MEDIAN,
    MAX_PRECISION, MAX_SAMPLES, MAX_WEIGHT, MIN_PRECISION, Recipe, RecipeError, VERSION,
};
use proptest::prelude::*;

use crate::recipes::{Change, Numbers, RidgeNumbers, linear, neural, parsed, refusal, sealed};
use crate::scanning::{MODELS, bytes_of};

/// The error of a descent's numbers after a change.
fn written(change: impl FnOnce(&mut Numbers)) -> Result<(), RecipeError> {
    let mut numbers = neural();
    change(&mut numbers);
    numbers.write().map(drop)
}

/// The error of a ridge's numbers after a change.
fn ridge_written(change: impl FnOnce(&mut RidgeNumbers)) -> Result<(), RecipeError> {
    let mut numbers = linear();
    change(&mut numbers);
    numbers.write().map(drop)
}

#[test]
fn a_descent_is_read_as_it_was_written() {
    for (model, parameters) in [
        (ModelKind::Phong, 7),
        (ModelKind::CookTorrance, 8),
        (ModelKind::Neural, 675),
    ] {
        let mut numbers = neural();
        numbers.model = model;
        numbers.initial.truncate(parameters);
        numbers.step_sizes.truncate(parameters);
        let recipe = parsed(numbers.write().unwrap());
        assert_eq!(recipe.model(), model);
        assert_eq!(recipe.samples(), 8);
        assert_eq!(recipe.expected_loss(), Some(0.03));
        assert!(recipe.ridge().is_none());
        let descent = recipe.descent().unwrap();
        assert_eq!(descent.model(), model);
        assert_eq!(descent.inner_steps(), 20);
        assert!(descent.initial().iter().eq(numbers.initial));
        assert!(descent.step_sizes().iter().eq(numbers.step_sizes));
        let angles = recipe
            .pattern()
            .flat_map(|a| [a.theta_h, a.theta_d, a.phi_d]);
        assert!(angles.eq(numbers.pattern));
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
fn a_ridge_is_read_as_it_was_written() {
    for (written, read) in [(0xfeed_beef, Some(0xfeed_beef)), (0, None)] {
        let numbers = RidgeNumbers {
            basis_checksum: written,
            ..linear()
        };
        let recipe = parsed(numbers.write().unwrap());
        assert_eq!(recipe.model(), ModelKind::Linear);
        assert_eq!(recipe.samples(), 8);
        assert_eq!(recipe.expected_loss(), Some(0.03));
        assert!(recipe.descent().is_none());
        let ridge = recipe.ridge().unwrap();
        assert_eq!(ridge.components(), 5);
        assert_eq!(ridge.problem().samples(), 8);
        assert_eq!(ridge.problem().components(), 5);
        assert!(ridge.basis().iter().eq(numbers.basis));
        assert!(ridge.mean().iter().eq(numbers.mean));
        assert!(ridge.median().iter().eq(numbers.median));
        assert!(ridge.weight().iter().eq(numbers.weight));
        assert!(ridge.precision().iter().eq(numbers.precision));
        assert_eq!(ridge.basis_checksum(), read);
    }
}

#[test]
fn any_flipped_bit_is_refused_by_name() {
    for model in MODELS {
        let mut bytes = bytes_of(model);
        for index in 0..bytes.len() {
            for bit in 0..8 {
                bytes[index] ^= 1 << bit;
                let error = refusal(&bytes);
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
fn any_truncation_or_padding_is_refused_by_name() {
    for model in MODELS {
        let whole = bytes_of(model);
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
            assert_eq!(refusal(&padded[..length]), error, "{length} bytes");
        }
    }
}

#[test]
fn any_other_format_is_refused_by_its_number() {
    let whole = bytes_of(ModelKind::Neural);
    assert_eq!(sealed(VERSION, &whole[HEADER_BYTES..]), whole);
    for version in [0, 1, 2, VERSION + 1, u16::MAX] {
        for body in [&whole[HEADER_BYTES..], &[]] {
            let error = RecipeError::Version(version);
            assert_eq!(refusal(&sealed(version, body)), error);
        }
    }
}

#[test]
fn wrong_counts_of_a_descent_are_refused() {
    let changes: [Change<Field, Numbers>; 9] = [
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
        assert_eq!(written(change), Err(error), "change {index}");
    }
    let error = RecipeError::Model(ModelKind::Linear);
    assert_eq!(written(|n| n.model = ModelKind::Linear), Err(error));
}

#[test]
fn wrong_counts_of_a_ridge_are_refused() {
    let changes: [Change<Field, RidgeNumbers>; 10] = [
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
        assert_eq!(ridge_written(change), Err(error), "change {index}");
    }
    let largest = ridge_written(|n| {
        n.components = MAX_COMPONENTS as u16;
        n.basis = vec![0.5; 8 * MAX_COMPONENTS];
        n.precision = vec![1.0; MAX_COMPONENTS];
    });
    assert_eq!(largest, Ok(()));
}

#[test]
fn signs_of_a_ridge_are_checked() {
    for bad in [0.0, -0.0, -1.0] {
        let error = RecipeError::NotPositive(Field::Weight);
        assert_eq!(ridge_written(|n| n.weight[3] = bad), Err(error));
        let error = RecipeError::NotPositive(Field::Precision);
        assert_eq!(ridge_written(|n| n.precision[4] = bad), Err(error));
    }
    let error = RecipeError::Negative(Field::Median);
    assert_eq!(ridge_written(|n| n.median[7] = -1e-9), Err(error));
    assert_eq!(ridge_written(|n| n.median[7] = 0.0), Ok(()));
}

/// The bounds of a ridge solve in f32.
#[test]
fn numbers_of_a_ridge_have_bounds() {
    type Entry = fn(&mut RidgeNumbers) -> &mut f32;
    let upper: [(Field, Entry, &[f32]); 5] = [
        (Field::Basis, |n| &mut n.basis[39], &[-MAX_BASIS, MAX_BASIS]),
        (Field::Mean, |n| &mut n.mean[7], &[-MAX_MEAN, MAX_MEAN]),
        (Field::Median, |n| &mut n.median[7], &[MAX_MEDIAN]),
        (Field::Weight, |n| &mut n.weight[7], &[MAX_WEIGHT]),
        (Field::Precision, |n| &mut n.precision[4], &[MAX_PRECISION]),
    ];
    for (field, entry, bounds) in upper {
        for bound in bounds {
            assert_eq!(ridge_written(|n| *entry(n) = *bound), Ok(()));
            for beyond in [bound * (1.0 + f32::EPSILON), f32::MAX.copysign(*bound)] {
                let error = RecipeError::Range(field);
                assert_eq!(ridge_written(|n| *entry(n) = beyond), Err(error));
            }
        }
    }
    let lowest = |precision| ridge_written(|n| n.precision[0] = precision);
    let error = RecipeError::Range(Field::Precision);
    assert_eq!(lowest(MIN_PRECISION), Ok(()));
    assert_eq!(lowest(MIN_PRECISION * (1.0 - f32::EPSILON)), Err(error));
    let text = error.to_string();
    for part in [Field::Precision.name(), "1e-6", "1e8"] {
        assert!(text.contains(part), "no {part} in {text}");
    }
}

#[test]
fn a_direction_below_the_horizon_is_refused() {
    // With phi_d turned by pi it is the other direction that sinks.
    for phi_d in [0.0, std::f32::consts::PI] {
        let found = written(|n| n.pattern[3..6].copy_from_slice(&[1.2, 1.2, phi_d]));
        assert_eq!(found, Err(RecipeError::BelowHorizon(1)));
    }
}

/// Their sines and cosines would not be those of a unit vector.
#[test]
fn angles_that_are_too_large_are_refused() {
    for angle in 0..3 {
        for value in [-1.001e3, 1.001e3, 5e8, 3e9] {
            let error = RecipeError::Range(Field::Pattern);
            assert_eq!(written(|n| n.pattern[angle] = value), Err(error));
        }
    }
    // Whole turns make no difference.
    let turned = written(|n| n.pattern[2] += 100.0 * std::f32::consts::TAU);
    assert_eq!(turned, Ok(()));
}

proptest! {
    #[test]
    fn no_number_of_a_descent_may_be_non_finite(
        which in 0..4usize,
        index: prop::sample::Index,
        value in prop::sample::select(vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY]),
    ) {
        let mut numbers = neural();
        let (field, list) = match which {
            0 => (Field::Pattern, &mut numbers.pattern[..]),
            1 => (Field::Initial, &mut numbers.initial[..]),
            2 => (Field::StepSizes, &mut numbers.step_sizes[..]),
            _ => (Field::ExpectedLoss, std::slice::from_mut(&mut numbers.expected_loss)),
        };
        *index.get_mut(list) = value;
        prop_assert_eq!(numbers.write(), Err(RecipeError::NonFinite(field)));
    }

    #[test]
    fn no_number_of_a_ridge_may_be_non_finite(
        which in 0..7usize,
        index: prop::sample::Index,
        value in prop::sample::select(vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY]),
    ) {
        let mut numbers = linear();
        let (field, list) = match which {
            0 => (Field::Pattern, &mut numbers.pattern[..]),
            1 => (Field::Basis, &mut numbers.basis[..]),
            2 => (Field::Mean, &mut numbers.mean[..]),
            3 => (Field::Median, &mut numbers.median[..]),
            4 => (Field::Weight, &mut numbers.weight[..]),
            5 => (Field::Precision, &mut numbers.precision[..]),
            _ => (Field::ExpectedLoss, std::slice::from_mut(&mut numbers.expected_loss)),
        };
        *index.get_mut(list) = value;
        prop_assert_eq!(numbers.write(), Err(RecipeError::NonFinite(field)));
    }

    #[test]
    fn a_body_of_noise_is_not_a_recipe(
        noise in prop::collection::vec(any::<u8>(), 0..200),
    ) {
        let error = refusal(&sealed(VERSION, &noise));
        let of_header = matches!(error, RecipeError::Checksum | RecipeError::Length { .. });
        prop_assert!(!of_header, "{}", error);
    }

    #[test]
    fn noise_is_not_a_recipe(noise in prop::collection::vec(any::<u8>(), 0..200)) {
        prop_assert!(Recipe::parse(&noise).is_err());
    }
}
