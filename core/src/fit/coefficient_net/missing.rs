//! The treatment of missing readings.

use crate::numeric::math::{exp, ln};

/// The treatment of missing readings in the training of a net.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MissingPolicy {
    /// A fit needs all readings.
    AllRequired = 0,
    /// Present readings are multiplied by their [`dropout_gain`](Self::dropout_gain).
    Scaled = 2,
}

impl MissingPolicy {
    /// Returns the policy with this number in a recipe.
    pub(crate) fn from_number(number: u8) -> Self {
        match number {
            0 => Self::AllRequired,
            _ => Self::Scaled,
        }
    }

    /// Returns the factor of the present mapped readings: sqrt(n / k) if k of n are present, at least one; otherwise 1.
    ///
    /// With this gain, the sum over k independent readings has the variance of a sum over n of them. It is between their
    /// mean (gain n / k) and their sum (gain 1). `present` has an entry for each sample: true if its reading is present.
    #[must_use]
    pub fn dropout_gain(self, present: impl ExactSizeIterator<Item = bool>) -> f32 {
        let samples = present.len();
        if self == Self::AllRequired {
            return 1.0;
        }
        match present.filter(|present| *present).count() {
            0 => 1.0,
            count if count == samples => 1.0,
            count => exp(0.5 * ln(samples as f32 / count as f32)),
        }
    }
}
