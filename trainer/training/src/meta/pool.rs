//! Materials as tasks: each evaluated once at a pool of uniform valid directions.
//!
//! The pool's directions are the same for all materials and in random order, so that any few
//! octets of it are a uniform random draw; training never evaluates a material elsewhere than in
//! its pool and at the pattern's directions.

use std::borrow::Cow;
use std::ops::Deref;

use glimpse_core::geometry::HalfDifference;
use glimpse_kernels::lanes::{InstructionSet, Octet, OctetAt, WIDTH};
use glimpse_kernels::samples::{OctetRgb, SampleOctets, SampleWeights, transpose_rgb};
use glimpse_kernels::sums::loss_of_black;
use glimpse_materials::Material;
use glimpse_materials::sampling::uniform_valid;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::augmentation::Augmentation;

/// The pool of directions, and each material's BRDF there.
pub struct Pool {
    at: Vec<OctetAt>,
    values: Vec<Vec<OctetRgb>>,
    /// The loss of black, f = 0, on each material.
    black: Vec<f32>,
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
                material.release();
                values.chunks(WIDTH).map(transpose_rgb).collect()
            })
            .collect();
        let mut pool = Self {
            at,
            values,
            black: Vec::new(),
        };
        let all = (0..materials.len()).into_par_iter();
        pool.black = all
            .map(|material| loss_of_black(&pool.all(material).octets()))
            .collect();
        pool
    }

    /// The loss of black, f = 0, on a material, over all directions.
    #[must_use]
    pub fn loss_of_black(&self, material: usize) -> f32 {
        self.black[material]
    }

    /// How many octets there are.
    #[must_use]
    pub fn octets(&self) -> usize {
        self.at.len()
    }

    /// Draws `count` samples of a material: whole octets, the last one filled up with weight 0.
    #[must_use]
    pub fn draw(&self, material: usize, count: usize, random: &mut ChaCha8Rng) -> Draw<'_> {
        let last = self.at.len() as u32;
        let order = (0..count.div_ceil(WIDTH)).map(|_| random.random_range(0..last));
        self.ordered(material, order.collect(), count)
    }

    /// The same of a augmentation of the material.
    #[must_use]
    pub fn draw_varied(
        &self,
        material: usize,
        augmentation: &Augmentation,
        count: usize,
        random: &mut ChaCha8Rng,
    ) -> Draw<'_> {
        let drawn = (0..count.div_ceil(WIDTH)).map(|_| random.random_range(0..self.at.len()));
        let (own, partner) = (&self.values[material], &self.values[augmentation.partner]);
        let (at, values): (Vec<_>, Vec<_>) = drawn
            .map(|octet| {
                let lanes: [[f32; 3]; WIDTH] = std::array::from_fn(|lane| {
                    let rgb = |octet: &OctetRgb| octet.each_ref().map(|channel| channel.0[lane]);
                    augmentation.brdf(rgb(&own[octet]), rgb(&partner[octet]))
                });
                (self.at[octet], transpose_rgb(&lanes))
            })
            .unzip();
        Draw {
            at: Cow::Owned(at),
            values: Cow::Owned(values),
            order: None,
            weights: weights(count),
        }
    }

    /// The first so many octets of a material, from one of them on: always the same samples, and
    /// as random as any.
    #[must_use]
    pub fn octets_from(&self, material: usize, first: usize, count: usize) -> Draw<'_> {
        let octets = first..first + count.div_ceil(WIDTH);
        let order = octets.map(|octet| (octet % self.at.len()) as u32);
        self.ordered(material, order.collect(), count)
    }

    /// All samples of a material.
    #[must_use]
    pub fn all(&self, material: usize) -> Draw<'_> {
        Draw {
            order: None,
            ..self.ordered(material, Vec::new(), self.at.len() * WIDTH)
        }
    }

    fn ordered(&self, material: usize, order: Vec<u32>, count: usize) -> Draw<'_> {
        Draw {
            at: Cow::Borrowed(&self.at),
            values: Cow::Borrowed(&self.values[material]),
            order: Some(order),
            weights: weights(count),
        }
    }
}

/// Some samples of one material, or of a augmentation of it, drawn from a pool.
pub struct Draw<'p> {
    at: Cow<'p, [OctetAt]>,
    values: Cow<'p, [OctetRgb]>,
    /// Which octets of those they are; all if there is no list.
    order: Option<Vec<u32>>,
    weights: [Octet; 2],
}

/// SampleWeights of octets in a mean over `count` samples and three channels: of all but the last, and
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
        self.order.as_ref().map_or(self.at.len(), Vec::len)
    }

    /// True if there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The samples, as kernels read them.
    #[must_use]
    pub fn octets(&self) -> SampleOctets<'_> {
        SampleOctets {
            at: &self.at,
            values: &self.values,
            order: self.order.as_deref(),
            weights: SampleWeights::Mean(self.weights),
            instruction_set: InstructionSet::of_this_machine(),
            in_a_row: false,
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

    /// A varied draw is the same places as a plain one of the same random numbers, and at each of
    /// them the augmentation of what is there.
    #[test]
    fn a_varied_draw_varies_what_a_plain_one_draws() {
        let pool = pool();
        let random = || ChaCha8Rng::seed_from_u64(5);
        let augmentation = Augmentation::random(2.0, 1, &mut random());
        let varied = pool.draw_varied(1, &augmentation, 60, &mut random());
        let drawn: Vec<usize> = {
            let mut random = random();
            (0..8)
                .map(|_| random.random_range(0..pool.octets()))
                .collect()
        };
        assert_eq!(varied.len(), drawn.len());
        for (found, octet) in drawn.iter().enumerate() {
            assert_eq!(varied.at[found], pool.at[*octet]);
            for lane in 0..WIDTH {
                let rgb = |values: &OctetRgb| values.each_ref().map(|octet| octet.0[lane]);
                let [own, partner] =
                    [1, 0].map(|material: usize| rgb(&pool.values[material][*octet]));
                assert_eq!(rgb(&varied.values[found]), augmentation.brdf(own, partner));
            }
        }
    }

    /// Against ln(1 + y c), one by one.
    #[test]
    fn black_loses_the_logarithm_of_what_there_is() {
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
            let found = f64::from(pool.loss_of_black(index));
            assert!(
                (found - expected).abs() < 1e-5 * expected,
                "{found} {expected}"
            );
        }
    }
}
