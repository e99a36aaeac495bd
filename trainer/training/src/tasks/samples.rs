//! Samples of a material with weights, in the layout of the kernels.

use glimpse_materials::half_differences;
use std::borrow::Cow;

use glimpse_kernels::lanes::{InstructionSet, Octet, OctetDirections, WIDTH};
use glimpse_kernels::samples::{OctetRgb, SampleOctets, transpose_rgb};
use glimpse_materials::Material;
use glimpse_materials::sampling::uniform_valid;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Samples of a material with weights.
pub struct WeightedSamples<'a> {
    /// The directions, in octets.
    pub at: Cow<'a, [OctetDirections]>,
    /// The BRDF there, sr⁻¹ (not times the cosine).
    pub values: Vec<OctetRgb>,
    /// The weights in a loss.
    pub weights: Vec<Octet>,
}

impl<'a> WeightedSamples<'a> {
    /// Creates samples for a mean over whole octets and three channels.
    #[must_use]
    pub fn uniform(at: Vec<OctetDirections>, values: Vec<OctetRgb>) -> Self {
        Self {
            at: at.into(),
            weights: vec![Octet([uniform_weight(values.len()); WIDTH]); values.len()],
            values,
        }
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
        Self {
            at: at.into(),
            values: brdf.chunks(WIDTH).map(transpose_rgb).collect(),
            weights,
        }
    }

    /// Returns the samples in the layout of the kernels.
    #[must_use]
    pub fn octets(&self) -> SampleOctets<'_> {
        SampleOctets {
            at: &self.at,
            values: &self.values,
            weights: &self.weights,
            instruction_set: InstructionSet::detect(),
        }
    }
}

/// A material at many directions, from which samples are drawn.
pub struct SampledMaterial {
    at: Vec<OctetDirections>,
    values: Vec<OctetRgb>,
}

impl SampledMaterial {
    /// Evaluates a material at `size` uniform directions, in whole octets.
    #[must_use]
    pub fn new(material: &dyn Material, size: usize, seed: u64) -> Self {
        let angles = uniform_valid(size.next_multiple_of(WIDTH), seed);
        let directions = half_differences(&angles);
        let brdf: Vec<[f32; 3]> = angles.iter().map(|at| material.at_angles(*at)).collect();
        Self {
            at: directions.chunks(WIDTH).map(Octet::transpose).collect(),
            values: brdf.chunks(WIDTH).map(transpose_rgb).collect(),
        }
    }

    /// Draws samples in whole octets, at least `count`.
    #[must_use]
    pub fn draw(&self, count: usize, random: &mut ChaCha8Rng) -> WeightedSamples<'static> {
        let indices = (0..count.div_ceil(WIDTH)).map(|_| random.random_range(0..self.at.len()));
        let (at, values) = indices
            .map(|index| (self.at[index], self.values[index]))
            .unzip();
        WeightedSamples::uniform(at, values)
    }

    /// Returns all samples.
    #[must_use]
    pub fn all(&self) -> WeightedSamples<'static> {
        WeightedSamples::uniform(self.at.clone(), self.values.clone())
    }
}

/// Returns the weight of each value in a mean over octets and three channels.
#[must_use]
pub fn uniform_weight(octets: usize) -> f32 {
    1.0 / (3 * WIDTH * octets) as f32
}
