//! The treatment of missing readings.

use crate::numeric::math::{exp, ln};

/// The treatment of missing readings in the training of a net.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MissingPolicy {
    /// A fit needs all readings.
    AllRequired = 0,
    /// Present readings keep their weight.
    Unscaled = 1,
    /// Present readings are multiplied by their [`dropout_gain`].
    Scaled = 2,
}

impl MissingPolicy {
    /// Returns the policy with this number in a recipe.
    pub(crate) fn from_number(number: u8) -> Self {
        match number {
            0 => Self::AllRequired,
            1 => Self::Unscaled,
            _ => Self::Scaled,
        }
    }

    /// Returns the factor of the present mapped readings.
    ///
    /// `present` has an entry for each sample: true if its reading is present. It is counted only if the factor depends
    /// on it.
    #[must_use]
    pub fn dropout_gain(self, present: impl ExactSizeIterator<Item = bool>) -> f32 {
        match self {
            Self::Scaled => {
                let samples = present.len();
                dropout_gain(samples, present.filter(|present| *present).count())
            }
            _ => 1.0,
        }
    }
}

/// Returns sqrt(n / k) if k of n readings are present, at least one; otherwise 1.
///
/// With this gain, the sum over k independent readings has the variance of a sum over n of them. It is between their
/// mean (gain n / k) and their sum (gain 1).
#[must_use]
pub fn dropout_gain(samples: usize, present: usize) -> f32 {
    if present == 0 || present >= samples {
        return 1.0;
    }
    exp(0.5 * ln(samples as f32 / present as f32))
}
