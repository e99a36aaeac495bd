//! Ridge solves that rounding makes singular end with finite coefficients.

use glimpse_core::fit::Linear;

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
