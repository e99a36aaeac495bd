//! Readings that are missing.

use crate::numeric::math::{exp, ln};

/// The treatment of missing readings that a completion was trained for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MissingPolicy {
    /// Nothing: a fit needs all of them.
    NoFit = 0,
    /// Those that are there count as they do among all.
    CountAlike = 1,
    /// Those that are there count for more, by their [`dropout_gain`].
    CountForMore = 2,
}

impl MissingPolicy {
    /// By its number in a recipe.
    pub(crate) fn of_number(number: u8) -> Option<Self> {
        let all = [Self::NoFit, Self::CountAlike, Self::CountForMore];
        all.get(usize::from(number)).copied()
    }

    /// What the readings are multiplied by that are there, once [standardized](super::standardized);
    /// of each it is told whether it is there. They are counted only where it matters.
    #[must_use]
    pub fn dropout_gain(self, present: impl ExactSizeIterator<Item = bool>) -> f32 {
        match self {
            Self::CountForMore => {
                dropout_gain(present.len(), present.filter(|there| *there).count())
            }
            _ => 1.0,
        }
    }
}

/// sqrt(n / k) where k of n readings are there, at least one: few readings then enter a sum over all samples with
/// the variance that many independent ones would, between their mean (gain n / k) and their sum (gain 1).
#[must_use]
pub fn dropout_gain(samples: usize, present: usize) -> f32 {
    if present == 0 || present >= samples {
        return 1.0;
    }
    exp(0.5 * ln(samples as f32 / present as f32))
}
