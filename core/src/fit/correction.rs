//! The correction of completed coefficients by the residuals of the readings.
//!
//! The completed coefficients c_0 are the mean of a Gaussian prior with learned precisions p. The readings update it:
//!
//! ```text
//! c = c_0 + z,   z = argmin |r - Q z|^2 + sum over k of p_k z_k^2 = (Q'Q + P)^-1 Q'r,   P = diag(p)
//! ```
//!
//! The rows of Q are the components at the samples of the present readings. r_i = ln((y w + e) / e) - center_i - (Q c_0)_i
//! is the residual of the reading y of a channel, and w = cos(theta_i) cos(theta_o). Q has at least as many components
//! as c_0, whose further coefficients are 0. The channels share the system.

use super::component_rows::ComponentRows;
use super::ridge::{add_outer_product, factorize_row_with, packed_length, solve_factorized};
use crate::model::linear::map;
use crate::model::{Sample, Samples};
use crate::numeric::Floats;

/// Number of color channels.
const CHANNELS: usize = 3;

/// A correction, read in place from a recipe.
#[derive(Clone, Copy, Debug)]
pub struct Correction<'a> {
    /// K components at the n samples.
    pub(crate) at_samples: ComponentRows<'a>,
    pub(crate) precision: Floats<'a>,
}

/// Returns the memory of a correction in words: the packed triangle of the system, a list for each channel, and the
/// innovation.
pub(crate) const fn correction_words(components: usize) -> usize {
    packed_length(components)
        .saturating_add(CHANNELS.saturating_mul(components))
        .saturating_add(1)
}

impl<'a> Correction<'a> {
    /// K, the number of components.
    #[must_use]
    pub fn components(&self) -> usize {
        self.precision.len()
    }

    /// The components at the samples of the pattern.
    #[must_use]
    pub fn at_samples(&self) -> ComponentRows<'a> {
        self.at_samples
    }

    /// The precision of each component.
    #[must_use]
    pub fn precision(&self) -> Floats<'a> {
        self.precision
    }

    /// The units of work: one for each reading, one for each row of the system, and one for each channel.
    pub(super) fn units(&self, samples: usize) -> usize {
        samples
            .saturating_add(self.components())
            .saturating_add(CHANNELS)
    }

    /// The corrected coefficients of each channel, in the memory of a finished correction.
    pub(super) fn coefficients<'w>(&self, words: &'w [f32]) -> [&'w [f32]; CHANNELS] {
        let lists = words.get(packed_length(self.components())..);
        let mut lists = lists.unwrap_or_default().chunks_exact(self.components().max(1));
        [(); CHANNELS].map(|()| lists.next().unwrap_or_default())
    }

    /// The innovation, in the memory of a finished correction: the mean of |r| over the present readings and channels.
    pub(super) fn innovation(&self, words: &[f32]) -> Option<f32> {
        words.last().copied()
    }

    /// Does a unit of work. `words` are 0 before the first unit. `initial` is c_0 of each channel.
    ///
    /// Not inlined, so that its stack is released between slices.
    #[inline(never)]
    pub(super) fn advance(
        &self,
        unit: usize,
        samples: Samples<'_>,
        center: Floats<'_>,
        initial: [&[f32]; CHANNELS],
        words: &mut [f32],
    ) {
        let components = self.components();
        let Some((innovation, words)) = words.split_last_mut() else {
            return;
        };
        let Some((packed, lists)) = words.split_at_mut_checked(packed_length(components)) else {
            return;
        };
        if let Some(sample) = samples.get(unit) {
            if sample.weight > 0.0 {
                let center = center.iter().nth(unit).unwrap_or_default();
                let sum = self.add_reading(unit, &sample, center, initial, packed, lists);
                *innovation += sum * sample.weight;
            }
            return;
        }
        let unit = unit.saturating_sub(samples.len());
        let Some(channel) = unit.checked_sub(components) else {
            let precision = self.precision.iter().nth(unit).unwrap_or(1.0);
            factorize_row_with(packed, unit, precision);
            return;
        };
        let list = lists.chunks_exact_mut(components.max(1)).nth(channel);
        if let Some((list, initial)) = list.zip(initial.get(channel)) {
            solve_factorized(packed, list);
            for (coefficient, initial) in list.iter_mut().zip(*initial) {
                *coefficient += initial;
            }
        }
    }

    /// Adds a reading to the system and to the right-hand side of each channel. Returns the sum of |r| over the channels.
    fn add_reading(
        &self,
        index: usize,
        sample: &Sample<f32>,
        center: f32,
        initial: [&[f32]; CHANNELS],
        packed: &mut [f32],
        lists: &mut [f32],
    ) -> f32 {
        let mut innovation = 0.0;
        let weight = sample.at.cos_theta_i() * sample.at.cos_theta_o();
        let lists = lists.chunks_exact_mut(self.components().max(1));
        for ((list, initial), measured) in lists.zip(initial).zip(sample.measured) {
            let completed = self.at_samples.combine(index, center, initial);
            let residual = map(measured, 0.0, weight) - completed;
            innovation += residual.abs();
            for (sum, entry) in list.iter_mut().zip(self.at_samples.row(index)) {
                *sum += residual * entry;
            }
        }
        add_outer_product(packed, self.at_samples.row(index), 1.0);
        innovation
    }
}
