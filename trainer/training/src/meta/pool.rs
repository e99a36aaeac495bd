//! Training tasks from a pool: each material is evaluated once at many uniform valid directions.
//!
//! The directions are the same for all materials and in random order, so any few octets are a uniform random draw.
//! Training evaluates materials only in their pool and at the pattern.

use std::borrow::Cow;
use std::ops::Deref;

use glimpse_core::geometry::HalfDifference;
use glimpse_kernels::lanes::{InstructionSet, Octet, OctetDirections, WIDTH};
use glimpse_kernels::samples::{OctetRgb, SampleOctets, SampleWeights, transpose_rgb};
use glimpse_kernels::sums::loss_of_black;
use glimpse_materials::Material;
use glimpse_materials::sampling::uniform_valid;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::augmentation::Augmentation;

/// The directions of the pool, and the BRDF of each material at them.
pub struct Pool {
    directions: Vec<OctetDirections>,
    values: Vec<Vec<OctetRgb>>,
    /// The loss of black (f = 0) on each material.
    black: Vec<f32>,
}

impl Pool {
    /// Evaluates all materials at `size` uniform valid directions, rounded up to octets.
    #[must_use]
    pub fn new<'m, M>(materials: &[M], size: usize, seed: u64) -> Self
    where
        M: Deref<Target = dyn Material + 'm> + Sync,
    {
        let octets = size.div_ceil(WIDTH);
        let angles = uniform_valid(octets * WIDTH, seed);
        let directions: Vec<OctetDirections> = angles
            .chunks(WIDTH)
            .map(|angles| {
                let directions: Vec<_> = angles
                    .iter()
                    .copied()
                    .map(HalfDifference::from_angles)
                    .collect();
                Octet::transpose(&directions)
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
        let mut pool = Self {
            directions,
            values,
            black: Vec::new(),
        };
        let all = (0..materials.len()).into_par_iter();
        pool.black = all
            .map(|material| loss_of_black(&pool.all(material).octets()))
            .collect();
        pool
    }

    /// Returns the loss of black (f = 0) on a material, over all directions.
    #[must_use]
    pub fn loss_of_black(&self, material: usize) -> f32 {
        self.black[material]
    }

    /// Returns the number of octets.
    #[must_use]
    pub fn octet_count(&self) -> usize {
        self.directions.len()
    }

    /// Draws `count` samples of a material in whole octets. Unused lanes of the last octet have weight 0.
    #[must_use]
    pub fn draw(&self, material: usize, count: usize, random: &mut ChaCha8Rng) -> DrawnSamples<'_> {
        let last = self.directions.len() as u32;
        let order = (0..count.div_ceil(WIDTH)).map(|_| random.random_range(0..last));
        self.ordered(material, order.collect(), count)
    }

    /// Draws `count` samples of an augmented material, as [`Pool::draw`] does.
    #[must_use]
    pub fn draw_augmented(
        &self,
        material: usize,
        augmentation: &Augmentation,
        count: usize,
        random: &mut ChaCha8Rng,
    ) -> DrawnSamples<'_> {
        let drawn =
            (0..count.div_ceil(WIDTH)).map(|_| random.random_range(0..self.directions.len()));
        let (own, partner) = (&self.values[material], &self.values[augmentation.partner]);
        let (directions, values): (Vec<_>, Vec<_>) = drawn
            .map(|octet| {
                let lanes: [[f32; 3]; WIDTH] = std::array::from_fn(|lane| {
                    let rgb = |octet: &OctetRgb| octet.each_ref().map(|channel| channel.0[lane]);
                    augmentation.brdf(rgb(&own[octet]), rgb(&partner[octet]))
                });
                (self.directions[octet], transpose_rgb(&lanes))
            })
            .unzip();
        DrawnSamples {
            directions: Cow::Owned(directions),
            values: Cow::Owned(values),
            order: None,
            weights: weights(count),
        }
    }

    /// Returns `count` samples of a material, starting at octet `first`. They are the same in each call. The directions
    /// of the pool are random, so these samples are random, too.
    #[must_use]
    pub fn octets_from(&self, material: usize, first: usize, count: usize) -> DrawnSamples<'_> {
        let octets = first..first + count.div_ceil(WIDTH);
        let order = octets.map(|octet| (octet % self.directions.len()) as u32);
        self.ordered(material, order.collect(), count)
    }

    /// Returns all samples of a material.
    #[must_use]
    pub fn all(&self, material: usize) -> DrawnSamples<'_> {
        DrawnSamples {
            order: None,
            ..self.ordered(material, Vec::new(), self.directions.len() * WIDTH)
        }
    }

    fn ordered(&self, material: usize, order: Vec<u32>, count: usize) -> DrawnSamples<'_> {
        DrawnSamples {
            directions: Cow::Borrowed(&self.directions),
            values: Cow::Borrowed(&self.values[material]),
            order: Some(order),
            weights: weights(count),
        }
    }
}

/// Samples of one material, or of an augmentation of it, drawn from a pool.
pub struct DrawnSamples<'p> {
    directions: Cow<'p, [OctetDirections]>,
    values: Cow<'p, [OctetRgb]>,
    /// The indices of the drawn octets; None for all.
    order: Option<Vec<u32>>,
    weights: [Octet; 2],
}

/// Returns two weights of octets in a mean over `count` samples and three channels. The first one is for all octets
/// except the last one. The second one is for the last octet: its unused lanes have weight 0.
fn weights(count: usize) -> [Octet; 2] {
    let weight = 1.0 / (3.0 * count as f32);
    let mut last = Octet::default();
    let used = count - (count.div_ceil(WIDTH) - 1) * WIDTH;
    for lane in last.0.iter_mut().take(used) {
        *lane = weight;
    }
    [Octet([weight; WIDTH]), last]
}

impl DrawnSamples<'_> {
    /// Returns the number of octets.
    #[must_use]
    pub fn len(&self) -> usize {
        self.order.as_ref().map_or(self.directions.len(), Vec::len)
    }

    /// Returns true if the draw is empty.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the samples in the layout of the kernels.
    #[must_use]
    pub fn octets(&self) -> SampleOctets<'_> {
        SampleOctets {
            at: &self.directions,
            values: &self.values,
            order: self.order.as_deref(),
            weights: SampleWeights::Mean(self.weights),
            instruction_set: InstructionSet::detect(),
            back_to_back: false,
        }
    }
}

#[cfg(test)]
mod tests {
    use glimpse_core::geometry::Angles;
    use rand::SeedableRng;

    use super::*;
    use glimpse_materials::Procedural;

    fn pool() -> Pool {
        let materials: Vec<Box<dyn Material>> = Procedural::set(2, 0)
            .into_iter()
            .map(|material| Box::new(material) as Box<dyn Material>)
            .collect();
        Pool::new(&materials, 256, 3)
    }

    /// With the same random numbers, an augmented draw has the directions of a plain draw, and the augmented BRDF at
    /// each.
    #[test]
    fn draw_augmented_augments_plain_draw() {
        let pool = pool();
        let random = || ChaCha8Rng::seed_from_u64(5);
        let augmentation = Augmentation::random(2.0, 1, &mut random());
        let augmented = pool.draw_augmented(1, &augmentation, 60, &mut random());
        let drawn: Vec<usize> = {
            let mut random = random();
            (0..8)
                .map(|_| random.random_range(0..pool.octet_count()))
                .collect()
        };
        assert_eq!(augmented.len(), drawn.len());
        for (index, octet) in drawn.iter().enumerate() {
            assert_eq!(augmented.directions[index], pool.directions[*octet]);
            for lane in 0..WIDTH {
                let rgb = |values: &OctetRgb| values.each_ref().map(|octet| octet.0[lane]);
                let [own, partner] =
                    [1, 0].map(|material: usize| rgb(&pool.values[material][*octet]));
                assert_eq!(
                    rgb(&augmented.values[index]),
                    augmentation.brdf(own, partner)
                );
            }
        }
    }

    /// Compares with ln(1 + y c), summed over samples.
    #[test]
    fn loss_of_black_is_mean_logarithm() {
        let pool = pool();
        let angles: Vec<Angles<f32>> = uniform_valid(256, 3);
        for (index, material) in Procedural::set(2, 0).iter().enumerate() {
            let losses = angles.iter().map(|angles| {
                let cosine = f64::from(HalfDifference::from_angles(*angles).cos_theta_i());
                let brdf = material.brdf(*angles);
                brdf.iter()
                    .map(|y| (f64::from(*y) * cosine).ln_1p())
                    .sum::<f64>()
            });
            let expected = losses.sum::<f64>() / (3.0 * 256.0);
            let loss = f64::from(pool.loss_of_black(index));
            assert!(
                (loss - expected).abs() < 1e-5 * expected,
                "{loss} {expected}"
            );
        }
    }
}
