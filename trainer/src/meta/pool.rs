//! Materials as tasks: each evaluated once at a pool of uniform valid directions.
//!
//! The pool's directions are the same for all materials and in random order, so that any few
//! octets of it are a uniform random draw; training never evaluates a material elsewhere than in
//! its pool and at the pattern's directions.

use std::cmp::Ordering;

use glimpse_core::angles::HalfDifference;
use glimpse_core::model::Sample;
use rand::Rng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::gradient::OctetSamples;
use crate::lanes::{Lanes, MOST_OCTETS, Octet, OctetAt, WIDTH, load_at};
use crate::material::Material;
use crate::sampling::uniform_valid;

/// Measured values of eight samples.
pub type OctetRgb = [Octet; 3];

/// The weights of an octet that is past the end of a list.
pub(super) const NO_WEIGHTS: Octet = Octet([0.0; WIDTH]);

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
    pub fn new(materials: &[Box<dyn Material>], size: usize, seed: u64) -> Self {
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
    /// Weights of all octets but the last, and of the last one.
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

impl OctetSamples for Draw<'_> {
    #[inline(always)]
    fn octets(&self) -> usize {
        self.indices.len()
    }

    #[inline(always)]
    fn read<L: Lanes>(&self, octet: usize) -> Sample<L> {
        let values = &self.pool.values[self.material];
        let last = self.indices.len() - 1;
        let [full, partial] = &self.weights;
        let mut at = [&self.pool.at[0]; MOST_OCTETS];
        let mut measured = [&values[0]; MOST_OCTETS];
        let mut weights = [&NO_WEIGHTS; MOST_OCTETS];
        for k in 0..L::OCTETS {
            let position = octet + k;
            let index = self.indices[position.min(last)] as usize;
            at[k] = &self.pool.at[index];
            measured[k] = &values[index];
            weights[k] = match position.cmp(&last) {
                Ordering::Less => full,
                Ordering::Equal => partial,
                Ordering::Greater => &NO_WEIGHTS,
            };
        }
        let Variation { order, gains } = self.variation;
        let [a, b, c, d] = measured;
        let mut brdf = [L::constant(0.0); 3];
        for ((y, from), gain) in brdf.iter_mut().zip(order).zip(gains) {
            *y = L::load([&a[from], &b[from], &c[from], &d[from]]) * L::broadcast(gain);
        }
        Sample {
            at: load_at(at),
            measured: brdf,
            weight: L::load(weights),
        }
    }
}
