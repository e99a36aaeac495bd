//! Linear's scan ends in the coefficients of its definition, whatever the recipe's numbers are.

use glimpse_core::fit::Linear;
use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::linear::{map, unmap};
use glimpse_core::recipe::{
    Field, MAX_BASIS, MAX_MEAN, MAX_MEDIAN, MAX_PRECISION, MAX_WEIGHT, MIN_PRECISION, Recipe,
    RecipeError,
};
use glimpse_core::scan::{Memory, Reading, Scan};
use proptest::prelude::*;

use super::common::{RidgeNumbers, linear, write_linear};
use super::scanning::{Outcome, SAMPLES, WORDS, material, whole};

/// What is read at a sample.
fn colour(index: u16) -> [f32; 3] {
    [0.2 + 0.1 * f32::from(index), 0.3, 0.05 * f32::from(index)]
}

#[test]
fn a_linear_scan_ends_in_coefficients() {
    let numbers = linear();
    let bytes = write_linear(&numbers).unwrap();
    let recipe = Recipe::parse(&bytes).unwrap();
    let mut memory = Memory::<Linear<WORDS>, SAMPLES>::new();
    let mut scan = Scan::new(recipe, &mut memory).unwrap();
    for index in 0..8 {
        let reading = Reading {
            brdf: colour(index),
            saturated: index < 2,
        };
        scan.record(index, reading).unwrap();
    }
    let mut fit = scan.fit().unwrap();
    // A row of the factorization or a channel at a time.
    for done in 1..=8 {
        assert!(!fit.progress().is_complete());
        assert_eq!(fit.advance(1).done, done);
    }
    assert!(fit.progress().is_complete());
    let fitted = fit.finish().unwrap();
    let coefficients: Vec<f32> = fitted.values().collect();
    let residual = fitted.residual();
    assert_eq!(coefficients.len(), 15);
    assert_eq!(residual.saturated, 2);

    // The normal equations hold: A'(t - A c) = P c. And the residual is that of the definition.
    let mut errors = [0.0_f32; 8];
    for (channel, c) in coefficients.chunks(5).enumerate() {
        let mut left: Vec<f64> = c.iter().map(|c| -40.0 * f64::from(*c)).collect();
        let mut scale = 0.0_f64;
        for (sample, row) in numbers.basis.chunks(5).enumerate() {
            let (mean, median) = (numbers.mean[sample], numbers.median[sample]);
            let weight = numbers.weight[sample];
            let y = colour(sample as u16)[channel];
            let explained: f32 = row.iter().zip(c).map(|(a, c)| a * c).sum();
            let rest = f64::from(map(y, median, weight) - mean - explained);
            for (left, a) in left.iter_mut().zip(row) {
                *left += f64::from(*a) * rest;
                scale = scale.max((f64::from(*a) * rest).abs());
            }
            let f = unmap(explained + mean, median, weight);
            let at = recipe.pattern().nth(sample).unwrap();
            let cosine = HalfDifference::from_angles(at).cos_theta_i();
            errors[sample] += ((1.0 + f * cosine) / (1.0 + y * cosine)).ln().abs() / 3.0;
        }
        for left in left {
            assert!(left.abs() < 1e-5 * scale, "{left} of {scale}");
        }
    }
    let mean: f32 = errors.iter().sum::<f32>() / 8.0;
    let worst = errors.iter().copied().fold(0.0, f32::max);
    let tolerance = if cfg!(feature = "micromath") {
        1e-3
    } else {
        1e-5
    };
    assert!(
        (residual.mean - mean).abs() < tolerance,
        "{residual:?}, {mean}"
    );
    assert!((residual.worst - worst).abs() < tolerance);
    assert!((errors[usize::from(residual.worst_index)] - worst).abs() < tolerance);
}

/// Begins by it and scans: no error at either.
fn scan_by(numbers: &RidgeNumbers) -> Outcome {
    let bytes = write_linear(numbers).unwrap();
    whole::<Linear<WORDS>>(Recipe::parse(&bytes).unwrap(), material)
}

/// Components alike, and priors that are lost in rounding: in version 0.1 the factorization met a
/// pivot that was not positive, and the scan could not begin.
#[test]
fn an_ill_conditioned_recipe_scans() {
    for (entry, precision) in [
        (1e4, 1e-3),
        (MAX_BASIS, MIN_PRECISION),
        (1e-3, MIN_PRECISION),
    ] {
        let mut numbers = linear();
        numbers.basis.fill(entry);
        numbers.precision.fill(precision);
        let outcome = scan_by(&numbers);
        assert!(
            matches!(outcome, Outcome::Fitted(..)),
            "{entry}: {outcome:?}"
        );
    }
    // What floats cannot hold is no recipe.
    let mut numbers = linear();
    numbers.basis.fill(1e30);
    let refused = write_linear(&numbers).unwrap_err();
    assert_eq!(refused, RecipeError::Range(Field::Basis));
}

/// Basis entries and precisions over all decades that a recipe may have.
fn decades() -> impl Strategy<Value = (Vec<f32>, Vec<f32>)> {
    let entry =
        (-6.0..3.5_f32, any::<bool>(), 0..4).prop_map(|(logarithm, negative, zero)| {
            match (zero, negative) {
                (0, _) => 0.0,
                (_, false) => 10.0_f32.powf(logarithm),
                (_, true) => -(10.0_f32.powf(logarithm)),
            }
        });
    let precision = (-5.99..7.99_f32).prop_map(|logarithm| 10.0_f32.powf(logarithm));
    (
        prop::collection::vec(entry, 40),
        prop::collection::vec(precision, 5),
    )
}

/// Any positive float from one to another, every exponent as likely as the next.
fn between(least: f32, most: f32) -> impl Strategy<Value = f32> {
    (least.to_bits()..=most.to_bits()).prop_map(f32::from_bits)
}

/// Any float up to this size.
fn within(most: f32) -> impl Strategy<Value = f32> {
    (between(0.0, most), any::<bool>())
        .prop_map(|(value, negative)| if negative { -value } else { value })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2_000))]
    /// In version 0.1 7,522 of 67,950 valid recipes failed to begin.
    #[test]
    fn a_forged_recipe_scans((basis, precision) in decades(), rank in 1..=5_usize) {
        let mut numbers = linear();
        numbers.basis = basis;
        numbers.precision = precision;
        // The last components are multiples of the first.
        for row in numbers.basis.chunks_mut(5) {
            for k in rank..5 {
                row[k] = 3.0 * row[k % rank];
            }
        }
        let outcome = scan_by(&numbers);
        prop_assert!(matches!(outcome, Outcome::Fitted(..) | Outcome::Diverged), "{:?}", outcome);
    }

    /// All numbers that a recipe may have, at random: finite values, or said to diverge.
    #[test]
    fn a_recipe_of_any_numbers_ends(
        basis in prop::collection::vec(within(MAX_BASIS), 40),
        mean in prop::collection::vec(within(MAX_MEAN), 8),
        median in prop::collection::vec(between(0.0, MAX_MEDIAN), 8),
        weight in prop::collection::vec(between(f32::from_bits(1), MAX_WEIGHT), 8),
        precision in prop::collection::vec(between(MIN_PRECISION, MAX_PRECISION), 5),
    ) {
        let numbers = RidgeNumbers { basis, mean, median, weight, precision, ..linear() };
        let outcome = scan_by(&numbers);
        prop_assert!(matches!(outcome, Outcome::Fitted(..) | Outcome::Diverged), "{:?}", outcome);
    }
}
