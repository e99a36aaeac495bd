//! Nothing but a whole recipe is a recipe, and what is wrong has a name.

mod common;
mod forged;

use common::{Numbers, RidgeNumbers, linear, neural, write, write_linear};
use forged::sealed;
use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{
    Field, HEADER_BYTES, Ingredients, MAX_BASIS, MAX_COMPONENTS, MAX_INNER_STEPS, MAX_MEAN,
    MAX_MEDIAN, MAX_PRECISION, MAX_SAMPLES, MAX_WEIGHT, MIN_PRECISION, PackedDescent,
    PackedLearner, PackedRidge, Recipe, RecipeError, VERSION,
};
use proptest::prelude::*;

fn phong() -> Numbers {
    Numbers {
        model: ModelKind::Phong,
        initial: vec![0.1; 7],
        step_sizes: vec![0.01; 7],
        ..neural()
    }
}

fn cook_torrance() -> Numbers {
    Numbers {
        model: ModelKind::CookTorrance,
        initial: vec![0.1; 8],
        step_sizes: vec![0.01; 8],
        ..neural()
    }
}

/// The name that a recipe altered at byte `index` is refused by.
fn expected(index: usize, error: RecipeError) -> bool {
    match index {
        0..4 => error == RecipeError::Magic,
        4..6 => matches!(error, RecipeError::Version(version) if version != VERSION),
        6..10 => matches!(error, RecipeError::Length { .. }),
        _ => error == RecipeError::Checksum,
    }
}

#[test]
fn what_is_written_is_read() {
    for numbers in [neural(), phong(), cook_torrance()] {
        let bytes = write(&numbers).unwrap();
        let recipe = Recipe::parse(&bytes).unwrap();
        assert_eq!(recipe.model(), numbers.model);
        assert_eq!(recipe.samples(), 8);
        assert_eq!(recipe.expected_loss(), Some(0.03));
        assert!(recipe.ridge().is_none());
        let descent = recipe.descent().unwrap();
        assert_eq!(descent.model(), numbers.model);
        assert_eq!(descent.inner_steps(), 20);
        assert!(descent.initial().iter().eq(numbers.initial));
        assert!(descent.step_sizes().iter().eq(numbers.step_sizes));
        let pattern = recipe
            .pattern()
            .flat_map(|a| [a.theta_h, a.theta_d, a.phi_d]);
        assert!(pattern.eq(numbers.pattern));
        assert_eq!(
            recipe.statements().unwrap().provenance.unwrap().trainer,
            "test"
        );
        let directions = recipe.pattern().map(|angles| {
            let at = HalfDifference::from_angles(angles);
            at.directions()
        });
        assert!(recipe.directions().eq((0..).zip(directions)));
    }
}

#[test]
fn a_ridge_that_is_written_is_read() {
    let numbers = linear();
    let bytes = write_linear(&numbers).unwrap();
    let recipe = Recipe::parse(&bytes).unwrap();
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
    assert_eq!(ridge.basis_checksum(), Some(0xfeed_beef));
    let none = RidgeNumbers {
        basis_checksum: 0,
        ..linear()
    };
    let bytes = write_linear(&none).unwrap();
    let recipe = Recipe::parse(&bytes).unwrap();
    assert_eq!(recipe.ridge().unwrap().basis_checksum(), None);
}

#[test]
fn any_flipped_bit_is_refused_by_name() {
    for original in [write(&neural()).unwrap(), write_linear(&linear()).unwrap()] {
        let mut bytes = original;
        for index in 0..bytes.len() {
            for bit in 0..8 {
                bytes[index] ^= 1 << bit;
                let error = Recipe::parse(&bytes).unwrap_err();
                assert!(expected(index, error), "byte {index}, bit {bit}: {error}");
                bytes[index] ^= 1 << bit;
            }
        }
    }
}

#[test]
fn any_truncation_is_refused_by_name() {
    refuses_truncations(&write(&neural()).unwrap());
    refuses_truncations(&write_linear(&linear()).unwrap());
}

fn refuses_truncations(bytes: &[u8]) {
    for length in 0..bytes.len() {
        let error = Recipe::parse(&bytes[..length]).unwrap_err();
        let found = length as u32;
        let named = match length {
            0..4 => error == RecipeError::Magic,
            4..HEADER_BYTES => {
                let expected = HEADER_BYTES as u32;
                error == RecipeError::Length { expected, found }
            }
            _ => {
                let expected = bytes.len() as u32;
                error == RecipeError::Length { expected, found }
            }
        };
        assert!(named, "{length} bytes: {error}");
    }
}

#[test]
fn any_other_format_is_refused_by_its_number() {
    let whole = write(&neural()).unwrap();
    assert_eq!(sealed(VERSION, &whole[HEADER_BYTES..]), whole);
    for version in [0, 1, 2, VERSION + 1, u16::MAX] {
        for body in [&whole[HEADER_BYTES..], &[]] {
            let error = Recipe::parse(&sealed(version, body)).unwrap_err();
            assert_eq!(error, RecipeError::Version(version));
        }
    }
}

#[test]
fn padding_is_refused() {
    let mut bytes = write(&phong()).unwrap();
    bytes.push(0);
    let error = Recipe::parse(&bytes).unwrap_err();
    assert!(matches!(error, RecipeError::Length { .. }));
}

#[test]
fn a_buffer_that_is_too_small_is_an_error() {
    let numbers = phong();
    let whole = write(&numbers).unwrap().len();
    let descent = PackedLearner::Descent(PackedDescent {
        model: numbers.model,
        inner_steps: 20,
        initial: &[0; 28],
        step_sizes: &[0; 28],
    });
    let one = 1.0_f32.to_le_bytes();
    let ridge = PackedLearner::Ridge(PackedRidge {
        components: 1,
        basis: &[0; 4],
        mean: &[0; 4],
        median: &[0; 4],
        weight: &one,
        precision: &one,
        basis_checksum: 0,
    });
    for learner in [descent, ridge] {
        let ingredients = Ingredients::new(&[0; 12], learner);
        let mut buffer = vec![0; whole];
        let written = Recipe::write(&ingredients, &mut buffer).unwrap().len();
        for length in 0..written {
            let error = Recipe::write(&ingredients, &mut buffer[..length]).unwrap_err();
            assert_eq!(error, RecipeError::BufferTooSmall);
        }
    }
}

#[test]
fn wrong_counts_are_refused() {
    let refused = |numbers: &Numbers| write(numbers).unwrap_err();
    let with = |change: fn(&mut Numbers)| {
        let mut numbers = neural();
        change(&mut numbers);
        refused(&numbers)
    };
    assert_eq!(
        with(|n| n.inner_steps = 0),
        RecipeError::Count(Field::InnerSteps)
    );
    assert_eq!(
        with(|n| n.inner_steps = MAX_INNER_STEPS + 1),
        RecipeError::Count(Field::InnerSteps)
    );
    assert_eq!(
        with(|n| n.pattern.clear()),
        RecipeError::Count(Field::Pattern)
    );
    assert_eq!(
        with(|n| n.pattern.push(0.1)),
        RecipeError::Count(Field::Pattern)
    );
    assert_eq!(
        with(|n| n.pattern = vec![0.1; 3 * (MAX_SAMPLES + 1)]),
        RecipeError::Count(Field::Pattern)
    );
    assert_eq!(
        with(|n| n.initial.push(0.1)),
        RecipeError::Count(Field::Initial)
    );
    assert_eq!(
        with(|n| n.initial.truncate(674)),
        RecipeError::Count(Field::Initial)
    );
    assert_eq!(
        with(|n| n.step_sizes.truncate(1)),
        RecipeError::Count(Field::StepSizes)
    );
    assert_eq!(
        with(|n| n.model = ModelKind::Phong),
        RecipeError::Count(Field::Initial)
    );
}

#[test]
fn only_what_is_fitted_by_descent_is_a_descent() {
    let mut numbers = neural();
    numbers.model = ModelKind::Linear;
    let error = RecipeError::Model(ModelKind::Linear);
    assert_eq!(write(&numbers).unwrap_err(), error);
}

#[test]
fn wrong_counts_of_a_ridge_are_refused() {
    let with = |field, change: fn(&mut RidgeNumbers)| {
        let mut numbers = linear();
        change(&mut numbers);
        let error = write_linear(&numbers).unwrap_err();
        assert_eq!(error, RecipeError::Count(field));
    };
    with(Field::Pattern, |n| n.pattern.clear());
    with(Field::Components, |n| n.components = 0);
    with(Field::Components, |n| {
        n.components = MAX_COMPONENTS as u16 + 1;
    });
    with(Field::Basis, |n| n.components = 4);
    with(Field::Basis, |n| n.basis.truncate(39));
    with(Field::Basis, |n| n.basis.push(0.1));
    with(Field::Mean, |n| n.mean.push(0.1));
    with(Field::Median, |n| n.median.truncate(7));
    with(Field::Weight, |n| n.weight.clear());
    with(Field::Precision, |n| n.precision.push(1.0));
    // The largest is no error.
    let mut numbers = linear();
    numbers.components = MAX_COMPONENTS as u16;
    numbers.basis = vec![0.5; 8 * MAX_COMPONENTS];
    numbers.precision = vec![1.0; MAX_COMPONENTS];
    assert!(write_linear(&numbers).is_ok());
}

#[test]
fn signs_of_a_ridge_are_checked() {
    let refused = |change: &dyn Fn(&mut RidgeNumbers)| {
        let mut numbers = linear();
        change(&mut numbers);
        write_linear(&numbers).unwrap_err()
    };
    for bad in [0.0, -0.0, -1.0] {
        let error = refused(&|n| n.weight[3] = bad);
        assert_eq!(error, RecipeError::NotPositive(Field::Weight));
        let error = refused(&|n| n.precision[4] = bad);
        assert_eq!(error, RecipeError::NotPositive(Field::Precision));
    }
    let error = refused(&|n| n.median[7] = -1e-9);
    assert_eq!(error, RecipeError::Negative(Field::Median));
    // A median of 0 is possible, and is in `linear` itself.
    assert_eq!(linear().median[0], 0.0);
}

/// What a ridge solve in f32 could not hold has no recipe.
#[test]
fn numbers_of_a_ridge_have_bounds() {
    let written = |change: &dyn Fn(&mut RidgeNumbers)| {
        let mut numbers = linear();
        change(&mut numbers);
        write_linear(&numbers).map(drop)
    };
    type Entry = fn(&mut RidgeNumbers) -> &mut f32;
    let list: [(Field, Entry, &[f32]); 5] = [
        (Field::Basis, |n| &mut n.basis[39], &[-MAX_BASIS, MAX_BASIS]),
        (Field::Mean, |n| &mut n.mean[7], &[-MAX_MEAN, MAX_MEAN]),
        (Field::Median, |n| &mut n.median[7], &[MAX_MEDIAN]),
        (Field::Weight, |n| &mut n.weight[7], &[MAX_WEIGHT]),
        (Field::Precision, |n| &mut n.precision[4], &[MAX_PRECISION]),
    ];
    for (field, entry, bounds) in list {
        for bound in bounds {
            assert_eq!(written(&|n| *entry(n) = *bound), Ok(()));
            let beyond = written(&|n| *entry(n) = bound * (1.0 + f32::EPSILON));
            assert_eq!(beyond, Err(RecipeError::Range(field)));
            let far = written(&|n| *entry(n) = f32::MAX.copysign(*bound));
            assert_eq!(far, Err(RecipeError::Range(field)));
        }
    }
    assert_eq!(written(&|n| n.precision[0] = MIN_PRECISION), Ok(()));
    let error = written(&|n| n.precision[0] = MIN_PRECISION * (1.0 - f32::EPSILON));
    assert_eq!(error, Err(RecipeError::Range(Field::Precision)));
    let text = RecipeError::Range(Field::Precision).to_string();
    for part in [Field::Precision.name(), "1e-6", "1e8"] {
        assert!(text.contains(part), "no {part} in {text}");
    }
}

#[test]
fn below_the_horizon_is_refused() {
    let mut numbers = neural();
    numbers.pattern[3..6].copy_from_slice(&[1.2, 1.2, 0.0]);
    assert_eq!(write(&numbers).unwrap_err(), RecipeError::BelowHorizon(1));
    // With phi_d turned round it is the other direction that sinks.
    numbers.pattern[5] = std::f32::consts::PI;
    assert_eq!(write(&numbers).unwrap_err(), RecipeError::BelowHorizon(1));
}

/// Their sines and cosines would be none of a unit vector.
#[test]
fn angles_that_are_too_large_are_refused() {
    for angle in 0..3 {
        for value in [-1.001e3, 1.001e3, 5e8, 3e9] {
            let mut numbers = neural();
            numbers.pattern[angle] = value;
            let error = write(&numbers).unwrap_err();
            assert_eq!(error, RecipeError::Range(Field::Pattern));
        }
    }
    // Whole turns make no difference.
    let mut numbers = neural();
    numbers.pattern[2] += 100.0 * std::f32::consts::TAU;
    assert!(write(&numbers).is_ok());
}

proptest! {
    #[test]
    fn no_number_may_be_non_finite(
        which in 0..4usize,
        index: prop::sample::Index,
        value in prop::sample::select(vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY]),
    ) {
        let mut numbers = neural();
        let field = match which {
            0 => {
                *index.get_mut(&mut numbers.pattern) = value;
                Field::Pattern
            }
            1 => {
                *index.get_mut(&mut numbers.initial) = value;
                Field::Initial
            }
            2 => {
                *index.get_mut(&mut numbers.step_sizes) = value;
                Field::StepSizes
            }
            _ => {
                numbers.expected_loss = value;
                Field::ExpectedLoss
            }
        };
        prop_assert_eq!(write(&numbers).unwrap_err(), RecipeError::NonFinite(field));
    }

    #[test]
    fn no_number_of_a_ridge_may_be_non_finite(
        which in 0..7usize,
        index: prop::sample::Index,
        value in prop::sample::select(vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY]),
    ) {
        let mut numbers = linear();
        let lists = [
            (Field::Pattern, &mut numbers.pattern),
            (Field::Basis, &mut numbers.basis),
            (Field::Mean, &mut numbers.mean),
            (Field::Median, &mut numbers.median),
            (Field::Weight, &mut numbers.weight),
            (Field::Precision, &mut numbers.precision),
        ];
        let field = match lists.into_iter().nth(which) {
            Some((field, list)) => {
                *index.get_mut(list) = value;
                field
            }
            None => {
                numbers.expected_loss = value;
                Field::ExpectedLoss
            }
        };
        prop_assert_eq!(write_linear(&numbers).unwrap_err(), RecipeError::NonFinite(field));
    }

    #[test]
    fn a_body_of_noise_is_no_recipe(
        noise in prop::collection::vec(any::<u8>(), 0..200),
    ) {
        let bytes = sealed(VERSION, &noise);
        let error = Recipe::parse(&bytes).unwrap_err();
        let of_header = matches!(error, RecipeError::Checksum | RecipeError::Length { .. });
        prop_assert!(!of_header, "{}", error);
    }

    #[test]
    fn noise_is_no_recipe(noise in prop::collection::vec(any::<u8>(), 0..200)) {
        prop_assert!(Recipe::parse(&noise).is_err());
    }
}
