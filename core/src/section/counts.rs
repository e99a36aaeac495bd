//! The counts in a recipe, which determine the lengths of lists, and the limits of counts and precisions.

use core::ops::RangeInclusive;

/// The largest number of samples.
pub const MAX_SAMPLES: usize = 4096;
/// The smallest precision of a coefficient or parameter.
pub const MIN_PRECISION: f32 = 1e-6;
/// The largest precision.
pub const MAX_PRECISION: f32 = 1e8;
/// The largest number of components.
pub const MAX_COMPONENTS: usize = 1024;

/// A count in a recipe, which determines lengths of lists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Count {
    /// n, samples of the pattern.
    Samples,
    /// K, components of the ridge stage.
    Components,
    /// m, coefficients that the net computes for each channel.
    Coefficients,
    /// m + h, coefficients and hidden units of the net.
    Rows,
    /// h, hidden units of the net.
    Hidden,
    /// g, units of the start.
    Units,
    /// P, parameters of the model.
    Parameters,
    /// A, active parameters of a Gauss-Newton system.
    Active,
    /// V, virtual readings.
    VirtualReadings,
    /// 1 + m, weights of the predicted loss.
    Weights,
    /// 3, channels or angles.
    Three,
}

impl Count {
    /// The symbol in documents, and the smallest and largest count.
    #[must_use]
    pub const fn bounds(self) -> (&'static str, RangeInclusive<usize>) {
        match self {
            Self::Samples => ("n", 0..=MAX_SAMPLES),
            Self::Components => ("K", 1..=MAX_COMPONENTS),
            Self::Coefficients => ("m", 1..=96),
            Self::Rows => ("(m + h)", 1..=96),
            Self::Hidden => ("h", 0..=95),
            Self::Units => ("g", 1..=32),
            Self::Parameters => ("P", 1..=usize::MAX),
            Self::Active => ("A", 1..=usize::MAX),
            Self::VirtualReadings => ("V", 1..=1024),
            Self::Weights => ("(1 + m)", 1..=usize::MAX),
            Self::Three => ("3", 3..=3),
        }
    }
}

/// The counts of a recipe, in the order of [`Count`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts(pub [usize; 11]);

impl Counts {
    pub(super) fn get(&self, count: Count) -> usize {
        self.0.get(count as usize).copied().unwrap_or_default()
    }

    pub(crate) fn set(&mut self, count: Count, value: usize) {
        if let Some(entry) = self.0.get_mut(count as usize) {
            *entry = value;
        }
    }
}
