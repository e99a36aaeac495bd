//! Ridge solves that rounding makes singular end with finite coefficients.

use glimpse_core::fit::Linear;
use proptest::prelude::*;

use crate::recipes::{Rows, linear};
use crate::scanning::{Outcome, full_scan, synthetic_reading};

const MAX_ROW: f32 = 1e4;
const MIN_PRECISION: f32 = 1e-6;

/// The outcome of a full scan of eight samples and five components.
fn scan_with(rows: &[f32], precision: &[f32]) -> Outcome {
    let mut contents = linear();
    contents.ridge().rows = Rows::floats(rows);
    contents.ridge().precision = precision.to_vec();
    full_scan::<Linear>(contents.recipe(), synthetic_reading)
}

/// Equal components, priors that are lost in rounding, and the smallest precision that a proptest found. In version
/// 0.1, the factorization met a pivot that was not positive, and the scan could not begin.
#[test]
fn fits_ill_conditioned_recipes() {
    let mut one_large_entry = vec![0.0; 40];
    one_large_entry[30] = MAX_ROW;
    for (basis, precision) in [
        (vec![1e4; 40], [1e-3; 5]),
        (vec![MAX_ROW; 40], [MIN_PRECISION; 5]),
        (vec![1e-3; 40], [MIN_PRECISION; 5]),
        (vec![0.0; 40], [1.0, 1.0, MIN_PRECISION, 1.0, 1.0]),
        (one_large_entry, [1.0; 5]),
    ] {
        let outcome = scan_with(&basis, &precision);
        assert!(
            matches!(outcome, Outcome::Fitted(..)),
            "{precision:?}: {outcome:?}"
        );
    }
}

/// Basis entries and precisions over all valid decades.
fn decades() -> impl Strategy<Value = (Vec<f32>, Vec<f32>)> {
    let size = (-6.0..3.5_f32).prop_map(|logarithm| 10.0_f32.powf(logarithm));
    let sign = prop::sample::select(vec![0.0, 0.0, 1.0, 1.0, 1.0, -1.0, -1.0, -1.0]);
    let entry = (size, sign).prop_map(|(size, sign)| sign * size);
    let precision = (-5.99..7.99_f32).prop_map(|logarithm| 10.0_f32.powf(logarithm));
    (
        prop::collection::vec(entry, 40),
        prop::collection::vec(precision, 5),
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2_000))]
    /// In version 0.1, 7,522 of 67,950 valid recipes could not begin a scan.
    #[test]
    fn low_rank_recipe_fits_or_diverges((mut rows, precision) in decades(), rank in 1..=5_usize) {
        // The last components are multiples of the first.
        for row in rows.chunks_mut(5) {
            for k in rank..5 {
                row[k] = 3.0 * row[k % rank];
            }
        }
        let outcome = scan_with(&rows, &precision);
        prop_assert!(matches!(outcome, Outcome::Fitted(..) | Outcome::Diverged), "{:?}", outcome);
    }
}
