//! Samples in memory: eight side by side, as registers load them.

use std::cmp::Ordering;

use glimpse_core::model::{Sample, SampleGradient};

use crate::lanes::{InstructionSet, Lanes, MOST_OCTETS, Octet, OctetAt, WIDTH, load_at};

/// Measured values of eight samples.
pub type OctetRgb = [Octet; 3];

/// Eight RGB values, channel by channel; missing ones are 0.
#[must_use]
pub fn transpose_rgb(values: &[[f32; 3]]) -> OctetRgb {
    let mut octets = OctetRgb::default();
    for (lane, rgb) in values.iter().take(WIDTH).enumerate() {
        for (octet, value) in octets.iter_mut().zip(rgb) {
            octet.0[lane] = *value;
        }
    }
    octets
}

/// SampleWeights in the loss: a mean over n samples and three channels has 1 / (3 n) each.
#[derive(Clone, Copy, Debug)]
pub enum SampleWeights<'a> {
    /// Of every octet.
    Each(&'a [Octet]),
    /// Of all octets but the last, and of the last one, whose lanes past the end have none.
    Mean([Octet; 2]),
}

/// Some samples of a material in octets, as kernels read them.
#[derive(Clone, Copy, Debug)]
pub struct SampleOctets<'a> {
    /// Places to choose from.
    pub at: &'a [OctetAt],
    /// The material's BRDF there, sr^-1.
    pub values: &'a [OctetRgb],
    /// Which of them the samples are, in order; all if there is no list.
    pub order: Option<&'a [u32]>,
    /// SampleWeights, in the order of the samples.
    pub weights: SampleWeights<'a>,
    /// The lanes to compute on.
    pub instruction_set: InstructionSet,
    /// Whether sums over such lists follow one another without a pause, as inner steps do. The
    /// other threads are then still awake, and shorter lists are worth sharing with them.
    pub in_a_row: bool,
}

impl SampleOctets<'_> {
    /// How many octets there are.
    #[must_use]
    pub fn octets(&self) -> usize {
        self.order.map_or(self.at.len(), <[u32]>::len)
    }

    /// So many of them as the lanes hold, from an octet on; weight 0 past the end.
    #[inline(always)]
    pub fn read<L: Lanes>(&self, octet: usize) -> Sample<L> {
        const NO_WEIGHTS: Octet = Octet([0.0; WIDTH]);
        let last = self.octets() - 1;
        let mut at = [&self.at[0]; MOST_OCTETS];
        let mut values = [&self.values[0]; MOST_OCTETS];
        let mut weights = [&NO_WEIGHTS; MOST_OCTETS];
        for k in 0..L::OCTETS {
            let position = octet + k;
            let index = match self.order {
                Some(order) => order[position.min(last)] as usize,
                None => position.min(last),
            };
            at[k] = &self.at[index];
            values[k] = &self.values[index];
            weights[k] = match (&self.weights, position.cmp(&last)) {
                (_, Ordering::Greater) => &NO_WEIGHTS,
                (SampleWeights::Each(weights), _) => &weights[position],
                (SampleWeights::Mean([full, _]), Ordering::Less) => full,
                (SampleWeights::Mean([_, partial]), Ordering::Equal) => partial,
            };
        }
        let [a, b, c, d] = values;
        Sample {
            at: load_at(at),
            measured: [0, 1, 2].map(|i| L::load([&a[i], &b[i], &c[i], &d[i]])),
            weight: L::load(weights),
        }
    }

    /// The same samples, as one of many sums in a row.
    #[must_use]
    pub fn in_a_row(self) -> Self {
        Self {
            in_a_row: true,
            ..self
        }
    }

    /// Room for the derivatives of a sum by its samples, all 0.
    #[must_use]
    pub fn zero_derivatives(&self) -> Vec<SampleGradient<Octet>> {
        let none = SampleGradient {
            at: OctetAt::default(),
            measured: OctetRgb::default(),
        };
        vec![none; self.octets()]
    }
}
