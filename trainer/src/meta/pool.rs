//! Materials as tasks: each evaluated once at a pool of uniform valid directions.
//!
//! The pool's directions are the same for all materials and in random order, so that any few
//! octets of it are a uniform random draw; training never evaluates a material elsewhere than in
//! its pool and at the pattern's directions.

use std::ops::Deref;

use glimpse_core::angles::HalfDifference;
use rand::Rng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::gradient::{SampleOctets, Weights};
use crate::lanes::{InstructionSet, Octet, OctetAt, WIDTH};
use crate::material::Material;
use crate::sampling::uniform_valid;

/// Measured values of eight samples.
pub type OctetRgb = [Octet; 3];

/// A material seen through a filter: each channel is another one of it, times a gain.
///
/// Such variations of the training materials are materials too, and there are far more of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Variation {
    /// Which channel of the material each channel is.
    pub order: [usize; 3],
    /// What it is multiplied by.
    pub gains: [f32; 3],
}

impl Variation {
    /// The material as it is.
    pub const NONE: Self = Self {
        order: [0, 1, 2],
        gains: [1.0; 3],
    };

    /// Channels in random order; gains between 1 / `gain` and `gain`: one for all channels, and
    /// the square root of the range for each.
    #[must_use]
    pub fn random(gain: f32, random: &mut ChaCha8Rng) -> Self {
        let mut order = [0, 1, 2];
        order.shuffle(random);
        let reach = gain.ln();
        let mut log_gain = |reach: f32| reach * (2.0 * random.random::<f32>() - 1.0);
        let shared = log_gain(reach);
        let gains = [0; 3].map(|_| (shared + log_gain(0.5 * reach)).exp());
        Self { order, gains }
    }
}

/// The pool of directions, and each material's BRDF there.
pub struct Pool {
    at: Vec<OctetAt>,
    values: Vec<Vec<OctetRgb>>,
}

impl Pool {
    /// Evaluates all materials at `size` (rounded up to octets) uniform valid directions.
    #[must_use]
    pub fn new<'m, M>(materials: &[M], size: usize, seed: u64) -> Self
    where
        M: Deref<Target = dyn Material + 'm> + Sync,
    {
        let octets = size.div_ceil(WIDTH);
        let angles = uniform_valid(octets * WIDTH, seed);
        let at: Vec<OctetAt> = angles
            .chunks(WIDTH)
            .map(|angles| {
                let at: Vec<_> = angles
                    .iter()
                    .copied()
                    .map(HalfDifference::from_angles)
                    .collect();
                Octet::transpose(&at)
            })
            .collect();
        let values = materials
            .par_iter()
            .map(|material| {
                let values: Vec<[f32; 3]> =
                    angles.iter().map(|angles| material.brdf(*angles)).collect();
                values.chunks(WIDTH).map(transpose_rgb).collect()
            })
            .collect();
        Self { at, values }
    }

    /// How many octets there are.
    #[must_use]
    pub fn octets(&self) -> usize {
        self.at.len()
    }

    /// Draws `count` samples of a material: whole octets, the last one filled up with weight 0.
    #[must_use]
    pub fn draw(
        &self,
        material: usize,
        variation: Variation,
        count: usize,
        random: &mut ChaCha8Rng,
    ) -> Draw<'_> {
        let last = self.at.len() as u32;
        let indices = (0..count.div_ceil(WIDTH)).map(|_| random.random_range(0..last));
        Draw {
            pool: self,
            material,
            variation,
            indices: indices.collect(),
            weights: weights(count),
        }
    }

    /// The first so many octets of a material, from one of them on: always the same samples, and
    /// as random as any.
    #[must_use]
    pub fn octets_from(&self, material: usize, first: usize, count: usize) -> Draw<'_> {
        let octets = count.div_ceil(WIDTH);
        let indices = (first..first + octets).map(|octet| (octet % self.at.len()) as u32);
        Draw {
            pool: self,
            material,
            variation: Variation::NONE,
            indices: indices.collect(),
            weights: weights(count),
        }
    }

    /// All samples of a material.
    #[must_use]
    pub fn all(&self, material: usize) -> Draw<'_> {
        Draw {
            pool: self,
            material,
            variation: Variation::NONE,
            indices: (0..self.at.len() as u32).collect(),
            weights: weights(self.at.len() * WIDTH),
        }
    }
}

/// Eight RGB values, channel by channel; missing ones are 0.
pub(super) fn transpose_rgb(values: &[[f32; 3]]) -> OctetRgb {
    let mut octets = OctetRgb::default();
    for (lane, rgb) in values.iter().take(WIDTH).enumerate() {
        for (octet, value) in octets.iter_mut().zip(rgb) {
            octet.0[lane] = *value;
        }
    }
    octets
}

/// Some samples of one material, drawn from a pool.
pub struct Draw<'p> {
    pool: &'p Pool,
    material: usize,
    variation: Variation,
    indices: Vec<u32>,
    weights: [Octet; 2],
}

/// Weights of octets in a mean over `count` samples and three channels: of all but the last, and
/// of the last one, whose lanes past the end have none.
fn weights(count: usize) -> [Octet; 2] {
    let weight = 1.0 / (3.0 * count as f32);
    let mut last = Octet::default();
    let taken = count - (count.div_ceil(WIDTH) - 1) * WIDTH;
    for lane in last.0.iter_mut().take(taken) {
        *lane = weight;
    }
    [Octet([weight; WIDTH]), last]
}

impl Draw<'_> {
    /// How many octets there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.indices.len()
    }

    /// True if there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.indices.is_empty()
    }

    /// The samples, as kernels read them.
    #[must_use]
    pub fn octets(&self) -> SampleOctets<'_> {
        SampleOctets {
            at: &self.pool.at,
            values: &self.pool.values[self.material],
            order: Some(&self.indices),
            variation: self.variation,
            weights: Weights::Mean(self.weights),
            instruction_set: InstructionSet::of_this_machine(),
            in_a_row: false,
        }
    }
}
