//! The gain of present readings beside missing ones.

use crate::numeric::math::{exp, ln};

/// Returns the factor of the present mapped readings: sqrt(n / k) if the net tolerates missing ones, and k of n are
/// present, at least one; otherwise 1.
///
/// With this gain, the sum over k independent readings has the variance of a sum over n of them. It is between their
/// mean (gain n / k) and their sum (gain 1). `present` has an entry for each sample: true if its reading is present.
#[must_use]
pub fn dropout_gain(tolerates_missing: bool, present: impl ExactSizeIterator<Item = bool>) -> f32 {
    let samples = present.len();
    if !tolerates_missing {
        return 1.0;
    }
    match present.filter(|present| *present).count() {
        0 => 1.0,
        count if count == samples => 1.0,
        count => exp(0.5 * ln(samples as f32 / count as f32)),
    }
}
