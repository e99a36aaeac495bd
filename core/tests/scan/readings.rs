//! What a reading can be, and what is remembered of it.

use glimpse_core::fit::Fitter;
use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::linear::EPSILON;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{LEAST_READING, Memory, Reading, ReadingError, Recorded, Residual, Scan};
use proptest::prelude::*;

use super::scanning::{Outcome, SAMPLES, every_fitter, fit, material, whole};

#[test]
fn impossible_readings_are_refused_and_asked_for_again() {
    fn check<K: Fitter>(recipe: Recipe<'_>) {
        let mut memory = Memory::<K, SAMPLES>::new();
        let mut scan = Scan::new(recipe, &mut memory).unwrap();
        let first = scan.next_pending().unwrap();
        let least = LEAST_READING;
        for (brdf, error) in [
            ([f32::NAN, 0.1, 0.1], ReadingError::NonFinite(0)),
            ([0.1, f32::INFINITY, 0.1], ReadingError::NonFinite(1)),
            ([0.1, 0.1, f32::NEG_INFINITY], ReadingError::NonFinite(2)),
            ([0.1, 0.1, least.next_down()], ReadingError::Negative(2)),
            ([f32::MIN, 0.1, 0.1], ReadingError::Negative(0)),
        ] {
            assert_eq!(scan.record(0, Reading::new(brdf)), Err(error));
            assert_eq!(scan.next_pending(), Some(first));
            assert_eq!(scan.reading(0), None);
        }
        for index in [8, 9, u16::MAX] {
            let samples = 8;
            let error = ReadingError::Index { index, samples };
            assert_eq!(scan.record(index, material(0)), Err(error));
            assert_eq!(scan.reading(index), None);
        }
        assert_eq!(scan.pending().count(), 8);
        // Dark is possible.
        let dark = Reading::monochrome(0.0);
        assert_eq!(scan.record(0, dark), Ok(Recorded::default()));
        assert_eq!(scan.next_pending().unwrap().0, 1);
    }
    every_fitter!(check);
}

/// There may be room for more samples than the recipe has: they are none.
#[test]
fn no_more_is_taken_than_the_recipe_asks_for() {
    fn check<K: Fitter>(recipe: Recipe<'_>) {
        let mut memory = Memory::<K, 12>::new();
        let mut scan = Scan::new(recipe, &mut memory).unwrap();
        for index in 0..8 {
            scan.record(index, material(index)).unwrap();
        }
        assert_eq!(scan.pending().count(), 0);
        for index in 8..12 {
            let samples = 8;
            let error = ReadingError::Index { index, samples };
            assert_eq!(scan.record(index, material(0)), Err(error));
        }
        assert_eq!(fit(&mut scan, &[13]), whole::<K>(recipe, material));
    }
    every_fitter!(check);
}

/// What the loss (1 + y cos > 0) or the mapping (y w + e > 0) of a recipe takes at a sample, half of
/// what is there at 0 being kept.
fn least(recipe: &Recipe<'_>, index: usize) -> f32 {
    match recipe.ridge() {
        Some(ridge) => -0.5 * EPSILON as f32 / ridge.weight().iter().nth(index).unwrap(),
        None => {
            let angles = recipe.pattern().nth(index).unwrap();
            -0.5 / HalfDifference::from_angles(angles).cos_theta_i()
        }
    }
}

/// A dark-subtracted reading may be below 0: as it is where the loss can take it, else brought up.
#[test]
fn slightly_negative_readings_are_taken_and_clamped_where_they_must_be() {
    fn check<K: Fitter>(recipe: Recipe<'_>) {
        let value = |index: usize| least(&recipe, index).max(LEAST_READING);
        let mut memory = Memory::<K, SAMPLES>::new();
        let mut scan = Scan::new(recipe, &mut memory).unwrap();
        for index in 0..8 {
            let reading = Reading::new([value(usize::from(index)), 0.1, 0.2]);
            let recorded = scan.record(index, reading).unwrap();
            assert!(!recorded.clamped && !recorded.replaced);
        }
        let (bits, residual) = match fit(&mut scan, &[9]) {
            Outcome::Fitted(bits, residual) => (bits, residual),
            other => panic!("{other:?}"),
        };
        assert_eq!(residual.clamped, 0);

        // What is further below 0 counts as if it were there, and is counted.
        let mut clamped = 0;
        for index in 0..8 {
            let brdf = [
                value(usize::from(index)).next_down().max(LEAST_READING),
                0.1,
                0.2,
            ];
            let recorded = scan.record(index, Reading::new(brdf)).unwrap();
            assert_eq!(
                recorded.clamped,
                brdf[0] < least(&recipe, usize::from(index))
            );
            assert_eq!(scan.reading(index).unwrap().brdf, brdf);
            clamped += u16::from(recorded.clamped);
        }
        let all = if recipe.ridge().is_some() { 8 } else { clamped };
        assert!(clamped > 0 && clamped == all, "{clamped}");
        assert_eq!(
            fit(&mut scan, &[9]),
            Outcome::Fitted(
                bits,
                Residual {
                    clamped,
                    ..residual
                }
            )
        );

        // Read anew, it is clamped no more.
        for index in 0..8 {
            scan.record(index, Reading::new([0.0, 0.1, 0.2])).unwrap();
        }
        match fit(&mut scan, &[9]) {
            Outcome::Fitted(_, residual) => assert_eq!(residual.clamped, 0),
            other => panic!("{other:?}"),
        }
    }
    every_fitter!(check);
}

#[test]
fn saturated_readings_are_counted_until_they_are_replaced_or_the_scan_begins_anew() {
    fn check<K: Fitter>(recipe: Recipe<'_>) {
        let mut memory = Memory::<K, SAMPLES>::new();
        let mut scan = Scan::new(recipe, &mut memory).unwrap();
        let saturated = |outcome| match outcome {
            Outcome::Fitted(_, residual) => residual.saturated,
            other => panic!("{other:?}"),
        };
        for index in 0..8 {
            let reading = Reading {
                brdf: [0.3; 3],
                saturated: index < 3,
            };
            scan.record(index, reading).unwrap();
        }
        assert_eq!(saturated(fit(&mut scan, &[64])), 3);
        scan.record(1, Reading::monochrome(0.3)).unwrap();
        assert_eq!(saturated(fit(&mut scan, &[64])), 2);
        scan.restart();
        assert_eq!(scan.next_pending().unwrap().0, 0);
        for index in 0..8 {
            scan.record(index, Reading::monochrome(0.3)).unwrap();
        }
        assert_eq!(saturated(fit(&mut scan, &[64])), 0);
    }
    every_fitter!(check);
}

#[test]
fn a_stuck_sensor_is_told_from_one_that_works() {
    fn check<K: Fitter>(recipe: Recipe<'_>) {
        let repeated = |brdfs: &[[f32; 3]; 8]| match whole::<K>(recipe, |index| {
            Reading::new(brdfs[usize::from(index)])
        }) {
            Outcome::Fitted(_, residual) => residual.repeated,
            other => panic!("{other:?}"),
        };
        assert_eq!(repeated(&[[0.3, 0.2, 0.1]; 8]), 7);
        let mut brdfs = [0, 1, 2, 3, 4, 5, 6, 7].map(|k| [0.3 + 0.01 * k as f32; 3]);
        assert_eq!(repeated(&brdfs), 0);
        brdfs[4] = brdfs[3];
        assert_eq!(repeated(&brdfs), 1);
    }
    every_fitter!(check);
}

/// A sensor with one channel makes a grey material.
#[test]
fn a_monochrome_reading_is_three_alike() {
    assert_eq!(Reading::monochrome(0.25), Reading::new([0.25; 3]));
    assert!(!Reading::monochrome(0.25).saturated);
}

fn check_taken<K: Fitter>(recipe: Recipe<'_>, brdfs: &[[f32; 3]]) {
    let outcome = whole::<K>(recipe, |index| Reading::new(brdfs[usize::from(index)]));
    assert!(matches!(outcome, Outcome::Fitted(..)), "{outcome:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]
    /// Whatever noise brings below 0, the fit ends.
    #[test]
    fn noise_below_zero_is_fitted(
        brdfs in prop::collection::vec(prop::array::uniform3(-1.0..0.5f32), 8),
    ) {
        every_fitter!(check_taken, &brdfs);
    }
}
