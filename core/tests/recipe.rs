//! Nothing but a whole recipe is a recipe, and what is wrong has a name.

mod common;

use common::{Numbers, neural, write};
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{
    Field, HEADER_BYTES, MAX_INNER_STEPS, MAX_SAMPLES, Recipe, RecipeError,
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
        4..6 => matches!(error, RecipeError::Version(_)),
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
        assert_eq!(recipe.inner_steps(), 20);
        assert_eq!(recipe.expected_loss(), 0.03);
        assert!(recipe.initial().iter().eq(numbers.initial));
        assert!(recipe.step_sizes().iter().eq(numbers.step_sizes));
        let pattern = recipe
            .pattern()
            .flat_map(|a| [a.theta_h, a.theta_d, a.phi_d]);
        assert!(pattern.eq(numbers.pattern));
        assert_eq!(recipe.provenance().trainer, "test");
    }
}

#[test]
fn any_flipped_bit_is_refused_by_name() {
    let mut bytes = write(&neural()).unwrap();
    for index in 0..bytes.len() {
        for bit in 0..8 {
            bytes[index] ^= 1 << bit;
            let error = Recipe::parse(&bytes).unwrap_err();
            assert!(expected(index, error), "byte {index}, bit {bit}: {error}");
            bytes[index] ^= 1 << bit;
        }
    }
}

#[test]
fn any_truncation_is_refused_by_name() {
    let bytes = write(&neural()).unwrap();
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
    let ingredients = glimpse_core::recipe::Ingredients {
        model: numbers.model,
        inner_steps: 20,
        pattern: &[0; 12],
        initial: &[0; 28],
        step_sizes: &[0; 28],
        expected_loss: 0.0,
        provenance: glimpse_core::recipe::Provenance {
            trainer: "",
            data: "",
            materials: 0,
            schedule: "",
            seed: 0,
        },
    };
    let mut buffer = vec![0; whole];
    let written = Recipe::write(&ingredients, &mut buffer).unwrap().len();
    for length in 0..written {
        let error = Recipe::write(&ingredients, &mut buffer[..length]).unwrap_err();
        assert_eq!(error, RecipeError::BufferTooSmall);
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
fn below_the_horizon_is_refused() {
    let mut numbers = neural();
    numbers.pattern[3..6].copy_from_slice(&[1.2, 1.2, 0.0]);
    assert_eq!(write(&numbers).unwrap_err(), RecipeError::BelowHorizon(1));
    // With phi_d turned round it is the other direction that sinks.
    numbers.pattern[5] = std::f32::consts::PI;
    assert_eq!(write(&numbers).unwrap_err(), RecipeError::BelowHorizon(1));
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
    fn noise_is_no_recipe(noise in prop::collection::vec(any::<u8>(), 0..200)) {
        prop_assert!(Recipe::parse(&noise).is_err());
    }
}
