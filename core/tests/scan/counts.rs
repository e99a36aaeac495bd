//! What is no BRDF ends in an error by name, and never in numbers that are none: raw counts, units
//! gone wrong, a sensor run wild.
//!
//! In version 0.1 readings times 16,777,215 ended in 219 NaN parameters, a finite residual and black
//! (on x86), one reading of `f32::MAX` in NaN coefficients and a residual of 87.9, and counts of 12
//! or 16 bits in a finished fit.

use glimpse_core::fit::{AnyModel, Fitter, linear_words};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{FitError, Memory, Reading, Scan};
use proptest::prelude::*;

use super::common::{linear, write_linear};
use super::scanning::{MODELS, Outcome, SAMPLES, every_fitter, fit, material, recipe_of, whole};

/// The recipes that the demo firmware is built with, which learn in large steps.
fn learned() -> Vec<(String, Vec<u8>)> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/recipes");
    let files = std::fs::read_dir(folder)
        .unwrap()
        .map(|file| file.unwrap().path());
    let recipes = files.filter(|path| path.extension().is_some_and(|ending| ending == "recipe"));
    let recipes: Vec<_> = recipes
        .map(|path| (path.display().to_string(), std::fs::read(path).unwrap()))
        .collect();
    assert!(recipes.len() >= 4, "{folder}");
    recipes
}

/// Room for them.
type Any = AnyModel<{ linear_words(SAMPLES, 60) }>;

/// What becomes of these readings by recipes made up and learned, each model by type and not. That
/// all numbers of a fitted material are finite, [`fit`] looks at.
fn outcomes(reading: impl Fn(u16) -> Reading + Copy) -> Vec<Outcome> {
    fn by_type<K: Fitter>(
        recipe: Recipe<'_>,
        reading: impl Fn(u16) -> Reading,
        outcomes: &mut Vec<Outcome>,
    ) {
        outcomes.push(whole::<K>(recipe, reading));
    }
    let mut outcomes = Vec::new();
    every_fitter!(by_type, reading, &mut outcomes);
    for (_, bytes) in learned() {
        let recipe = Recipe::parse(&bytes).unwrap();
        outcomes.push(whole::<Any>(recipe, reading));
    }
    outcomes
}

/// A Lambertian material with a highlight, as sensors see it: from 0.06 to 3 sr^-1.
fn plausible(index: u16) -> [f32; 3] {
    let highlight = if index == 2 { 2.5 } else { 0.0 };
    [0.30 + highlight, 0.12 + highlight, 0.06 + highlight]
        .map(|f| f * (1.0 + 0.01 * f32::from(index)))
}

#[test]
fn readings_times_16777215_are_refused() {
    for outcome in outcomes(|index| Reading::new(plausible(index).map(|f| f * 16_777_215.0))) {
        assert_eq!(outcome, Outcome::Implausible);
    }
    assert!(
        outcomes(|index| Reading::new(plausible(index)))
            .iter()
            .all(|outcome| matches!(outcome, Outcome::Fitted(..)))
    );
}

#[test]
fn raw_counts_are_refused() {
    // 0.3 sr^-1, a perfect white, is a good part of the range.
    for white in [4_095.0_f32, 65_535.0] {
        let count = |f: f32| (f / 0.32 * 0.7 * white).min(white).round();
        for outcome in outcomes(|index| Reading {
            brdf: plausible(index).map(count),
            saturated: index == 2,
        }) {
            assert_eq!(outcome, Outcome::Implausible);
        }
        // A stuck sensor, all of it.
        for outcome in outcomes(|_| Reading::monochrome(white)) {
            assert_eq!(outcome, Outcome::Implausible);
        }
    }
    for outcome in outcomes(|_| Reading::monochrome(f32::MAX)) {
        assert_eq!(outcome, Outcome::Implausible);
    }
}

#[test]
fn counts_are_refused_with_the_limit() {
    let bytes = recipe_of(MODELS[2]);
    let mut memory = Memory::<Any, 8>::new();
    let mut scan = Scan::new(Recipe::parse(&bytes).unwrap(), &mut memory).unwrap();
    for index in 0..8 {
        scan.record(index, Reading::monochrome(1_000.0)).unwrap();
    }
    let error = scan.fit().err().unwrap();
    assert_eq!(error, FitError::Implausible { limit: 10 });
    // The readings are still there, and can be replaced.
    assert_eq!(scan.pending().count(), 0);
    for index in 0..8 {
        assert!(scan.record(index, material(index)).unwrap().replaced);
    }
    assert!(matches!(fit(&mut scan, &[50]), Outcome::Fitted(..)));
}

/// Real materials are shiny: nickel is above 10 sr^-1 at 12 of the 24 readings of Neural's pattern,
/// whose theta_d are large, and its lower quartile is below 1 (as is every material's of MERL and
/// RGL: at most 1.2 with any of the demo's four patterns).
#[test]
fn a_metal_at_grazing_angles_is_no_count() {
    fn check<K: Fitter>(recipe: Recipe<'_>) {
        let shiny = |index: u16| {
            Reading::new(if index < 6 {
                [60.0, 50.0, 40.0]
            } else {
                [0.9; 3]
            })
        };
        let mut memory = Memory::<K, SAMPLES>::new();
        let mut scan = Scan::new(recipe, &mut memory).unwrap();
        for index in 0..8 {
            scan.record(index, shiny(index)).unwrap();
        }
        assert!(scan.fit().is_ok());
        scan.record(6, Reading::new([0.9, 11.0, 0.9])).unwrap();
        assert!(scan.fit().is_err());
    }
    every_fitter!(check);
}

/// One wild reading among good ones: whatever becomes of it, it is no silent NaN.
#[test]
fn a_single_wild_reading_ends_in_numbers_or_is_said_to_diverge() {
    let mut fitted = 0;
    let mut diverged = 0;
    for wild in [f32::MAX, 1e30, 1e10, 65_535.0] {
        for at in 0..8 {
            for channel in 0..4 {
                for outcome in outcomes(|index| {
                    let mut brdf = plausible(index);
                    for (k, value) in brdf.iter_mut().enumerate() {
                        if index == at && (channel == 3 || channel == k) {
                            *value = wild;
                        }
                    }
                    Reading::new(brdf)
                }) {
                    match outcome {
                        Outcome::Fitted(..) => fitted += 1,
                        Outcome::Diverged => diverged += 1,
                        Outcome::Implausible => panic!("most readings were good"),
                    }
                }
            }
        }
    }
    println!("{fitted} fitted, {diverged} diverged");
    assert!(fitted > 0);
}

/// Up to half of the readings wild, of any size that a float has.
fn check_wild<K: Fitter>(recipe: Recipe<'_>, wild: &[(usize, f32)]) {
    whole::<K>(recipe, |index| {
        let mut brdf = plausible(index);
        for (place, value) in wild {
            if place / 3 == usize::from(index) {
                brdf[place % 3] = *value;
            }
        }
        Reading::new(brdf)
    });
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn wild_readings_never_end_in_a_nan(
        wild in prop::collection::vec(
            (0..24_usize, (0..0x7f80_0000_u32).prop_map(f32::from_bits)),
            1..24,
        ),
    ) {
        every_fitter!(check_wild, &wild);
        for (_, bytes) in learned() {
            check_wild::<Any>(Recipe::parse(&bytes).unwrap(), &wild);
        }
    }
}

/// A fit whose numbers run away says so, whichever elementary functions there are: by the network's
/// own output (e^z - 1), where no parameter need be infinite.
#[test]
fn an_infinite_brdf_is_a_diverged_fit() {
    use glimpse_core::model::{Neural, ParameterSet};
    let mut numbers = super::common::neural();
    let mut network = <Neural as glimpse_core::model::Model>::ZEROS;
    network.b3 = [3e38; 3];
    numbers.initial = network.iter().copied().collect();
    numbers.step_sizes.fill(0.0);
    let bytes = super::common::write(&numbers).unwrap();
    let outcome = whole::<Neural>(Recipe::parse(&bytes).unwrap(), material);
    assert_eq!(outcome, Outcome::Diverged);

    // Linear's: all numbers finite, e to their power not.
    let mut numbers = linear();
    numbers.basis.fill(0.0);
    numbers.mean.fill(100.0);
    let bytes = write_linear(&numbers).unwrap();
    let outcome = whole::<Any>(Recipe::parse(&bytes).unwrap(), material);
    assert_eq!(outcome, Outcome::Diverged);
}
