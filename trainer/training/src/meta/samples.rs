//! Samples of a material with weights, in the layout of the kernels.

use std::borrow::Cow;

use glimpse_kernels::lanes::{InstructionSet, Octet, OctetDirections, WIDTH};
use glimpse_kernels::samples::{OctetRgb, SampleOctets, SampleWeights, transpose_rgb};

/// Samples of a material with weights.
pub struct WeightedSamples<'a> {
    at: Cow<'a, [OctetDirections]>,
    values: Vec<OctetRgb>,
    weights: Vec<Octet>,
}

impl<'a> WeightedSamples<'a> {
    /// Creates samples from directions, the BRDF there (sr⁻¹, not times the cosine), and weights, all in octets.
    #[must_use]
    pub fn new(at: Cow<'a, [OctetDirections]>, values: Vec<OctetRgb>, weights: Vec<Octet>) -> Self {
        Self {
            at,
            values,
            weights,
        }
    }

    /// Creates samples for a mean over whole octets and three channels.
    #[must_use]
    pub fn uniform(at: Vec<OctetDirections>, values: Vec<OctetRgb>) -> Self {
        let weights = vec![Octet([uniform_weight(values.len()); WIDTH]); values.len()];
        Self::new(at.into(), values, weights)
    }

    /// Creates samples for a mean over the present ones of some readings, and three channels. `brdf` and `present` have
    /// an entry for each direction.
    #[must_use]
    pub fn present(at: &'a [OctetDirections], brdf: &[[f32; 3]], present: &[bool]) -> Self {
        let count = present.iter().filter(|present| **present).count().max(1);
        let mut weights = vec![Octet::default(); brdf.len().div_ceil(WIDTH)];
        for (index, _) in present.iter().enumerate().filter(|(_, present)| **present) {
            weights[index / WIDTH].0[index % WIDTH] = 1.0 / (3.0 * count as f32);
        }
        let values = brdf.chunks(WIDTH).map(transpose_rgb).collect();
        Self::new(at.into(), values, weights)
    }

    /// Returns the samples in the layout of the kernels.
    #[must_use]
    pub fn octets(&self) -> SampleOctets<'_> {
        SampleOctets {
            at: &self.at,
            values: &self.values,
            order: None,
            weights: SampleWeights::Each(&self.weights),
            instruction_set: InstructionSet::detect(),
            back_to_back: false,
        }
    }
}

/// Returns the weight of each value in a mean over octets and three channels.
#[must_use]
pub fn uniform_weight(octets: usize) -> f32 {
    1.0 / (3 * WIDTH * octets) as f32
}
