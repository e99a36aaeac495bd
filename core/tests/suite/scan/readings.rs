//! Readings that are rejected, clamped or counted.

use crate::recipes::tolerant;
use crate::scanning::*;
use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::fit::Estimator;
use glimpse_core::geometry::HalfDifference;
use glimpse_core::gonio::{MIN_READING, Reading};
use glimpse_core::model::linear::EPSILON;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{Recorded, Residual};

#[test]
fn rejects_invalid_readings() {
    for mut scan in empty_scans() {
        let first = scan.next_pending().unwrap();
        let below = MIN_READING.next_down();
        for (brdf, error) in [
            ([f32::NAN, 0.1, 0.1], (ErrorCode::ReadingNonFinite, 0)),
            ([0.1, f32::INFINITY, 0.1], (ErrorCode::ReadingNonFinite, 1)),
            ([0.1, 0.1, -f32::INFINITY], (ErrorCode::ReadingNonFinite, 2)),
            ([0.1, 0.1, below], (ErrorCode::ReadingNegative, 2)),
            ([f32::MIN, 0.1, 0.1], (ErrorCode::ReadingNegative, 0)),
        ] {
            let error = Error::with(error.0, [0, error.1]);
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

/// The smallest BRDF y that the loss or the mapping of a recipe accepts at a sample: 1 + y cos(theta_i) = 1/2, or
/// y w + e = e / 2.
fn min_reading(recipe: &Recipe<'_>, index: u16) -> f32 {
    let angles = recipe.pattern().nth(usize::from(index)).unwrap();
    let at = HalfDifference::from_angles(angles);
    let by_loss = -0.5 / at.cos_theta_i();
    let by_mapping = -0.5 * EPSILON as f32 / (at.cos_theta_i() * at.cos_theta_o());
    match recipe.estimator() {
        Estimator::Sgd(_) => by_loss,
        Estimator::Ridge { .. } => by_loss.max(by_mapping),
    }
}

/// A dark-subtracted reading may be below 0. It is kept if the fit accepts it, otherwise clamped, by all stages.
#[test]
fn clamps_negative_readings() {
    let nets = tolerant();
    let nets = nets.iter().map(|contents| new_scan(contents.recipe()));
    for mut scan in empty_scans().into_iter().chain(nets) {
        let recipe = *scan.recipe();
        let samples = 0..recipe.samples() as u16;
        for index in samples.clone() {
            let value = min_reading(&recipe, index).max(MIN_READING);
            let recorded = scan.record(index, Reading::new([value, 0.1, 0.2]));
            assert_eq!(recorded, Ok(Recorded::default()));
        }
        let unclamped = fit(&mut scan, &[9]);
        let residual = unclamped.residual();
        assert_eq!(residual.clamped, 0);

        // A smaller reading is fitted as the smallest valid one, and counted as clamped.
        let mut clamped = 0;
        for index in samples.clone() {
            let value = min_reading(&recipe, index).next_down().max(MIN_READING);
            let brdf = [value, 0.1, 0.2];
            let recorded = scan.record(index, Reading::new(brdf)).unwrap();
            assert_eq!(recorded.clamped, value < min_reading(&recipe, index));
            assert_eq!(scan.reading(index).unwrap().brdf, brdf);
            clamped += u16::from(recorded.clamped);
        }
        assert!(clamped > 0, "{clamped}");
        let actual = fit(&mut scan, &[9]);
        assert_eq!(actual.bits(), unclamped.bits());
        let expected = Residual {
            clamped,
            implausible: Some(ErrorCode::Dark),
            ..residual
        };
        assert_eq!(actual.residual(), expected);

        // A new reading is not clamped.
        record(&mut scan, samples, |_| Reading::new([0.0, 0.1, 0.2]));
        assert_eq!(fit(&mut scan, &[9]).residual().clamped, 0);
    }
}
