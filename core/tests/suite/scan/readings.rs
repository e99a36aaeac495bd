//! Readings that are rejected, clamped or counted.

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::ModelKind;
use glimpse_core::model::linear::EPSILON;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{MIN_READING, Reading, Recorded, Residual, Scan};
use proptest::prelude::*;

use crate::scanning::{
    Any, MODELS, Outcome, empty_scans, fit, full_scan, recipe_for, record, synthetic_reading,
};

#[test]
fn rejects_invalid_readings() {
    for mut scan in empty_scans() {
        let first = scan.next_pending().unwrap();
        for (brdf, error) in [
            (
                [f32::NAN, 0.1, 0.1],
                Error::with(ErrorCode::ReadingNonFinite, [0, 0]),
            ),
            (
                [0.1, f32::INFINITY, 0.1],
                Error::with(ErrorCode::ReadingNonFinite, [0, 1]),
            ),
            (
                [0.1, 0.1, f32::NEG_INFINITY],
                Error::with(ErrorCode::ReadingNonFinite, [0, 2]),
            ),
            (
                [0.1, 0.1, MIN_READING.next_down()],
                Error::with(ErrorCode::ReadingNegative, [0, 2]),
            ),
            (
                [f32::MIN, 0.1, 0.1],
                Error::with(ErrorCode::ReadingNegative, [0, 0]),
            ),
        ] {
            assert_eq!(scan.record(0, Reading::new(brdf)), Err(error));
            assert_eq!(scan.next_pending(), Some(first));
            assert_eq!(scan.reading(0), None);
        }
        // Black is valid.
        let dark = Reading::monochrome(0.0);
        assert_eq!(scan.record(0, dark), Ok(Recorded::default()));
        assert_eq!(scan.next_pending().unwrap().0, 1);
    }
}

/// The memory may be larger than the recipe needs.
#[test]
fn rejects_unknown_samples() {
    for model in MODELS {
        let recipe = recipe_for(model);
        let mut memory = [0.0; 2_000];
        let mut scan = Scan::<Any>::new(recipe, &mut memory).unwrap();
        record(&mut scan, 0..8, synthetic_reading);
        assert_eq!(scan.pending().count(), 0);
        for index in [8, 9, 11, 12, u16::MAX] {
            let samples = 8_u16;
            let error = Error::with(ErrorCode::ReadingIndex, [index.into(), samples.into()]);
            assert_eq!(scan.record(index, synthetic_reading(0)), Err(error));
            assert_eq!(scan.reading(index), None);
        }
        assert_eq!(
            fit(&mut scan, &[13]),
            full_scan::<Any>(recipe, synthetic_reading)
        );
    }
}

/// The smallest BRDF y that the loss or the mapping of a recipe accepts at a sample: 1 + y cos(theta_i) = 1/2, or
/// y w + e = e / 2.
fn min_reading(recipe: &Recipe<'_>, index: u16) -> f32 {
    let index = usize::from(index);
    match recipe.ridge() {
        Some(ridge) => -0.5 * EPSILON as f32 / ridge.weight().iter().nth(index).unwrap(),
        None => {
            let angles = recipe.pattern().nth(index).unwrap();
            -0.5 / HalfDifference::from_angles(angles).cos_theta_i()
        }
    }
}

/// A dark-subtracted reading may be below 0. It is kept if the loss accepts it, otherwise clamped.
#[test]
fn clamps_negative_readings() {
    for mut scan in empty_scans() {
        let recipe = *scan.recipe();
        for index in 0..8 {
            let value = min_reading(&recipe, index).max(MIN_READING);
            let recorded = scan.record(index, Reading::new([value, 0.1, 0.2]));
            assert_eq!(recorded, Ok(Recorded::default()));
        }
        let unclamped = fit(&mut scan, &[9]);
        let residual = unclamped.residual();
        assert_eq!(residual.clamped, 0);

        // A smaller reading is fitted as the smallest valid one, and counted as clamped.
        let mut clamped = 0;
        for index in 0..8 {
            let value = min_reading(&recipe, index).next_down().max(MIN_READING);
            let brdf = [value, 0.1, 0.2];
            let recorded = scan.record(index, Reading::new(brdf)).unwrap();
            assert_eq!(recorded.clamped, value < min_reading(&recipe, index));
            assert_eq!(scan.reading(index).unwrap().brdf, brdf);
            clamped += u16::from(recorded.clamped);
        }
        let all = if recipe.model() == ModelKind::Linear {
            8
        } else {
            clamped
        };
        assert!(clamped > 0 && clamped == all, "{clamped}");
        let actual = fit(&mut scan, &[9]);
        assert_eq!(actual.bits(), unclamped.bits());
        let expected = Residual {
            clamped,
            implausible: Some(ErrorCode::Dark),
            ..residual
        };
        assert_eq!(actual.residual(), expected);

        // A new reading is not clamped.
        record(&mut scan, 0..8, |_| Reading::new([0.0, 0.1, 0.2]));
        assert_eq!(fit(&mut scan, &[9]).residual().clamped, 0);
    }
}

#[test]
fn counts_saturated_readings() {
    for mut scan in empty_scans() {
        record(&mut scan, 0..8, |index| Reading {
            brdf: [0.3; 3],
            saturated: index < 3,
        });
        assert_eq!(fit(&mut scan, &[64]).residual().saturated, 3);
        let clear = |_| Reading::monochrome(0.3);
        record(&mut scan, [1], clear);
        assert_eq!(fit(&mut scan, &[64]).residual().saturated, 2);
        scan.restart();
        assert_eq!(scan.next_pending().unwrap().0, 0);
        record(&mut scan, 0..8, clear);
        assert_eq!(fit(&mut scan, &[64]).residual().saturated, 0);
    }
}

#[test]
fn counts_repeated_readings() {
    let distinct = [0, 1, 2, 3, 4, 5, 6, 7].map(|k| [0.3 + 0.01 * k as f32; 3]);
    let mut one_pair = distinct;
    one_pair[4] = one_pair[3];
    for model in MODELS {
        for (brdfs, repeated) in [([[0.3, 0.2, 0.1]; 8], 7), (distinct, 0), (one_pair, 1)] {
            let outcome = full_scan::<Any>(recipe_for(model), |index| {
                Reading::new(brdfs[usize::from(index)])
            });
            assert_eq!(outcome.residual().repeated, repeated, "{model}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]
    /// The fit finishes with any noise below 0.
    #[test]
    fn fits_noise_below_zero(
        brdfs in prop::collection::vec(prop::array::uniform3(-1.0..0.5f32), 8),
    ) {
        for model in MODELS {
            let reading = |index: u16| Reading::new(brdfs[usize::from(index)]);
            let outcome = full_scan::<Any>(recipe_for(model), reading);
            prop_assert!(matches!(outcome, Outcome::Fitted(..)), "{model}: {outcome:?}");
        }
    }
}
