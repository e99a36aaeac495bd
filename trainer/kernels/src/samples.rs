//! Samples in memory, in groups of eight as registers load them.

use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::{Sample, SampleGradient};

use crate::lanes::{
    InstructionSet, Lanes, MAX_OCTETS, Octet, OctetDirections, WIDTH, coordinates_mut, load,
    load_directions,
};

/// The measured values of eight samples.
pub type OctetRgb = [Octet; 3];

/// Transposes up to eight RGB values to three octets, one per channel; unused lanes are 0.
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

/// Samples of a material in octets, as kernels read them.
#[derive(Clone, Copy, Debug)]
pub struct SampleOctets<'a> {
    /// The half and difference vectors.
    pub at: &'a [OctetDirections],
    /// The material's BRDF at these directions, sr^-1 (not times the cosine).
    pub values: &'a [OctetRgb],
    /// The weights of samples in the loss: 1 / (3 n) each for a mean over n samples and three channels, 0 for unused lanes.
    pub weights: &'a [Octet],
    /// The lanes to compute on.
    pub instruction_set: InstructionSet,
}

impl SampleOctets<'_> {
    /// Returns the number of octets.
    #[must_use]
    pub fn octets(&self) -> usize {
        self.at.len()
    }

    /// Reads samples into lanes, beginning with an octet. Lanes past the end have weight 0.
    #[inline(always)]
    pub fn read<L: Lanes>(&self, octet: usize) -> Sample<L> {
        const NO_WEIGHTS: Octet = Octet([0.0; WIDTH]);
        let last = self.octets() - 1;
        let mut at = [&self.at[0]; MAX_OCTETS];
        let mut values = [&self.values[0]; MAX_OCTETS];
        let mut weights = [&NO_WEIGHTS; MAX_OCTETS];
        for k in 0..L::OCTETS {
            let index = (octet + k).min(last);
            at[k] = &self.at[index];
            values[k] = &self.values[index];
            if octet + k <= last {
                weights[k] = &self.weights[index];
            }
        }
        Sample {
            at: load_directions(at),
            measured: [
                load!(values, rgb => rgb[0]),
                load!(values, rgb => rgb[1]),
                load!(values, rgb => rgb[2]),
            ],
            weight: L::load(weights),
        }
    }

    /// Returns a sample in lane `lane` of an octet.
    #[must_use]
    pub fn sample(&self, octet: usize, lane: usize) -> Sample<f32> {
        Sample {
            at: HalfDifference::from_array(self.at[octet].to_array().map(|octet| octet.0[lane])),
            measured: self.values[octet].map(|values| values.0[lane]),
            weight: self.weights[octet].0[lane],
        }
    }

    /// Returns zeros for the derivatives of a sum with respect to its samples.
    #[must_use]
    pub fn zero_derivatives(&self) -> Vec<SampleGradient<Octet>> {
        let none = SampleGradient {
            at: OctetDirections::default(),
            measured: OctetRgb::default(),
        };
        vec![none; self.octets()]
    }
}

/// Returns the entries of a gradient with respect to a sample.
#[inline(always)]
pub(crate) fn entries<S: Copy>(gradient: SampleGradient<S>) -> [S; 8] {
    let [hx, hz, dx, dy, dz] = gradient.at.to_array();
    let [red, green, blue] = gradient.measured;
    [hx, hz, dx, dy, dz, red, green, blue]
}

/// Returns references to the [`entries`] of a gradient.
#[inline(always)]
pub(crate) fn entries_mut<S>(gradient: &mut SampleGradient<S>) -> [&mut S; 8] {
    let [hx, hz, dx, dy, dz] = coordinates_mut(&mut gradient.at);
    let [red, green, blue] = &mut gradient.measured;
    [hx, hz, dx, dy, dz, red, green, blue]
}
