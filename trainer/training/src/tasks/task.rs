//! Training tasks: augmented materials with noisy and missing readings.
//!
//! The augmented material of a task is a mixture of a filtered material and a partner, each with a highlight warp. A
//! smooth field multiplies the mixture.

use glimpse_fitting::recipe::ReadingNoise;
use glimpse_kernels::lanes::WIDTH;
use glimpse_kernels::samples::OctetRgb;
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::pool::{FIELD_TERMS, WarpedPool};
use super::samples::WeightedSamples;
use crate::initialization::standard_normal;

/// The readings of tasks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReadingOptions {
    /// The share of tasks with missing readings.
    pub missing_share: f32,
    /// The noise of readings.
    pub noise: ReadingNoise,
}

impl ReadingOptions {
    /// Returns true if the recipe tolerates missing readings.
    #[must_use]
    pub fn tolerates_missing(&self) -> bool {
        self.missing_share > 0.0
    }
}

// The augmentation has the smallest loss on materials outside the training set.
/// The range of a filter's gains. Each gain is the product of a shared factor, between 1 / `MAX_GAIN` and `MAX_GAIN`, and
/// a factor of its channel, between the square roots of these bounds.
const MAX_GAIN: f32 = 1.5;
/// The maximum deviation of the partner's share in a channel from the share drawn for all channels.
const SHARE_SPREAD: f32 = 0.3;
/// The standard deviation of the coefficients of smooth fields.
const FIELD_DEVIATION: f32 = 0.1;

/// A group of materials, and its share of all tasks.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialGroup {
    /// The indices of the materials, at least one.
    pub materials: Vec<usize>,
    /// The share of tasks, 0 to 1. The shares of all groups sum to 1.
    pub share: f32,
}

/// Draws a group with a probability equal to its share, then one of its materials with equal probabilities.
fn draw_material(groups: &[MaterialGroup], random: &mut ChaCha8Rng) -> usize {
    let mut rest: f32 = random.random();
    let mut materials: &[usize] = &[];
    for group in groups {
        materials = &group.materials;
        rest -= group.share;
        if rest < 0.0 {
            break;
        }
    }
    materials[random.random_range(0..materials.len())]
}

/// The distribution of missing readings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dropout {
    /// Any number of arbitrary readings: the samples are not sorted yet.
    Any,
    /// In two of three cases, all readings after the first few, as in a scan that ends early. Otherwise, one or two
    /// arbitrary readings.
    TailOrFew,
}

/// The share of scans ending early that keep exactly half of the readings. With it, a recipe for n samples also
/// replaces a recipe for n / 2 samples. A uniform choice of the end would train this case too rarely.
const HALF_SHARE: f32 = 0.2;

/// Draws the present readings of a task: true for each present reading. `missing_share` is the probability of missing
/// readings.
fn draw_present(
    samples: usize,
    missing_share: f32,
    dropout: Dropout,
    random: &mut ChaCha8Rng,
) -> Vec<bool> {
    let mut present = vec![true; samples];
    if samples < 2 || random.random::<f32>() >= missing_share {
        return present;
    }
    if dropout == Dropout::TailOrFew && random.random_range(0..3) == 0 {
        for _ in 0..random.random_range(1..=2.min(samples - 1)) {
            present[random.random_range(0..samples)] = false;
        }
        return present;
    }
    let ends_halfway = dropout == Dropout::TailOrFew && random.random::<f32>() < HALF_SHARE;
    let count = if ends_halfway {
        samples / 2
    } else {
        random.random_range(1..samples)
    };
    present[count..].fill(false);
    if dropout == Dropout::Any {
        present.shuffle(random);
    }
    present
}

/// A training task.
#[derive(Clone, Debug)]
pub struct TrainingTask {
    /// The index of the material.
    pub material: usize,
    /// The source channel of each channel.
    pub channels: [usize; 3],
    /// The gain of each channel.
    pub gains: [f32; 3],
    /// The index of the partner material.
    pub partner: usize,
    /// The partner's share in each channel.
    pub shares: [f32; 3],
    /// The indices of the highlight warps of material and partner.
    pub warps: [usize; 2],
    /// The coefficients of the smooth field.
    pub field: [f32; FIELD_TERMS],
    /// True for each present reading.
    pub present: Vec<bool>,
    /// A factor and an offset (sr⁻¹) for each reading and channel; empty without noise.
    pub noise: Vec<[[f32; 3]; 2]>,
    /// The octets of pool directions at which the loss is evaluated.
    pub octets: Vec<u32>,
    /// The roughness of the BRDF; None for a smooth one.
    pub roughness: Option<Roughness>,
}

/// A random factor of the BRDF at each direction, independent of the factors at all other directions. It imitates
/// structure and measurement noise that the training materials do not have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Roughness {
    /// The standard deviation of the logarithm of the factor that all channels share.
    deviation: f32,
    /// The seed of the factors at the directions of the loss.
    seed: u64,
}

impl Roughness {
    /// The range of deviations.
    const DEVIATIONS: [f32; 2] = [0.12, 0.7];
    /// The deviation of a channel from the shared factor, as a share of the deviation.
    const CHANNEL_SHARE: f32 = 0.3;

    /// Draws a deviation with a uniform logarithm, and a seed.
    fn random(random: &mut ChaCha8Rng) -> Self {
        let [min, max] = Self::DEVIATIONS;
        Self {
            deviation: min * (max / min).powf(random.random()),
            seed: random.random(),
        }
    }

    /// Draws the factor of each channel at a direction.
    fn factors(self, random: &mut ChaCha8Rng) -> [f32; 3] {
        let shared = standard_normal(random);
        [(); 3].map(|()| {
            let own = Self::CHANNEL_SHARE * standard_normal(random);
            (self.deviation * (shared + own)).exp()
        })
    }
}

impl TrainingTask {
    /// Creates a task without augmentation, noise or missing readings. The loss is evaluated at all pool directions.
    #[must_use]
    pub fn plain(material: usize, samples: usize, octets: usize) -> Self {
        Self {
            material,
            channels: [0, 1, 2],
            gains: [1.0; 3],
            partner: material,
            shares: [0.0; 3],
            warps: [0; 2],
            field: [0.0; FIELD_TERMS],
            present: vec![true; samples],
            noise: Vec::new(),
            octets: (0..octets as u32).collect(),
            roughness: None,
        }
    }

    /// Draws a task with `samples` readings. The loss is evaluated at random octets of pool directions, at least
    /// `outer_samples` directions in total.
    #[must_use]
    pub fn random(
        pool: &WarpedPool,
        groups: &[MaterialGroup],
        options: &ReadingOptions,
        [samples, outer_samples]: [usize; 2],
        dropout: Dropout,
        random: &mut ChaCha8Rng,
    ) -> Self {
        let [material, partner] = [(); 2].map(|()| draw_material(groups, random));
        let mut channels = [0, 1, 2];
        channels.shuffle(random);
        let bound = MAX_GAIN.ln();
        let mut log_gain = |bound: f32| bound * (2.0 * random.random::<f32>() - 1.0);
        let shared = log_gain(bound);
        let gains = [(); 3].map(|()| (shared + log_gain(0.5 * bound)).exp());
        let share: f32 = random.random();
        let warps = [material, partner].map(|index| random.random_range(0..pool.warps(index)));
        let shares = [(); 3].map(|()| {
            let deviation = SHARE_SPREAD * (2.0 * random.random::<f32>() - 1.0);
            (share + deviation).clamp(0.0, 1.0)
        });
        let field = [(); FIELD_TERMS].map(|()| FIELD_DEVIATION * standard_normal(random));
        let present = draw_present(samples, options.missing_share, dropout, random);
        let (multiplicative, additive) = (options.noise.multiplicative, options.noise.additive);
        let noise = if multiplicative + additive > 0.0 {
            (0..samples)
                .map(|_| {
                    let factor = [(); 3].map(|()| 1.0 + multiplicative * standard_normal(random));
                    [factor, [(); 3].map(|()| additive * standard_normal(random))]
                })
                .collect()
        } else {
            Vec::new()
        };
        Self {
            material,
            channels,
            gains,
            partner,
            shares,
            warps,
            field,
            present,
            noise,
            octets: pool.draw(outer_samples, random),
            roughness: None,
        }
    }

    /// Ends the scan after its first `count` readings, all of which are present.
    #[must_use]
    pub fn ending_after(mut self, count: usize) -> Self {
        for (index, present) in self.present.iter_mut().enumerate() {
            *present = index < count;
        }
        self
    }

    /// Makes the BRDF rough, at the samples and at the directions of the loss.
    #[must_use]
    pub fn with_roughness(mut self, random: &mut ChaCha8Rng) -> Self {
        let roughness = Roughness::random(random);
        self.noise.resize(self.present.len(), [[1.0; 3], [0.0; 3]]);
        for [factors, _] in &mut self.noise {
            for (noise, factor) in factors.iter_mut().zip(roughness.factors(random)) {
                *noise *= factor;
            }
        }
        self.roughness = Some(roughness);
        self
    }

    /// Returns the square root of the share of present readings, as a weight of the loss. Fewer readings cause a larger
    /// loss, which would dominate the gradient.
    #[must_use]
    pub fn reading_weight(&self) -> f32 {
        let count = self.present.iter().filter(|present| **present).count();
        (count as f32 / self.present.len() as f32).sqrt()
    }

    /// Returns true if the smooth field differs from 1 anywhere.
    #[must_use]
    pub fn has_field(&self) -> bool {
        self.field != [0.0; FIELD_TERMS]
    }

    /// Returns true if the partner has a share in any channel.
    #[must_use]
    pub fn has_partner(&self) -> bool {
        self.shares != [0.0; 3]
    }

    /// Returns the samples of the loss.
    #[must_use]
    pub fn samples(&self, pool: &WarpedPool) -> WeightedSamples<'static> {
        let directions = self.octets.iter();
        let directions = directions.map(|octet| pool.octet_directions[*octet as usize]);
        WeightedSamples::uniform(directions.collect(), self.values(pool))
    }

    /// Returns the BRDF at the directions of the loss, sr⁻¹.
    #[must_use]
    pub fn values(&self, pool: &WarpedPool) -> Vec<OctetRgb> {
        let own = pool.values(self.material, self.warps[0]);
        let partner = pool.values(self.partner, self.warps[1]);
        let mut roughness = self
            .roughness
            .map(|roughness| (roughness, ChaCha8Rng::seed_from_u64(roughness.seed)));
        let octets = self.octets.iter().map(|octet| {
            let (own, partner) = (&own[*octet as usize], &partner[*octet as usize]);
            let mut values = OctetRgb::default();
            let mut factor = [1.0; WIDTH];
            if self.has_field() {
                let fields = &pool.fields[*octet as usize];
                for (lane, factor) in factor.iter_mut().enumerate() {
                    let terms = self.field.iter().zip(fields);
                    let sum: f32 = terms.map(|(c, f)| c * f.0[lane]).sum();
                    *factor = sum.exp();
                }
            }
            for (channel, values) in values.iter_mut().enumerate() {
                let own = &own[self.channels[channel]].0;
                let partner = &partner[channel].0;
                let share = self.shares[channel];
                let gain = (1.0 - share) * self.gains[channel];
                for lane in 0..WIDTH {
                    values.0[lane] = factor[lane] * (gain * own[lane] + share * partner[lane]);
                }
            }
            if let Some((roughness, random)) = &mut roughness {
                for lane in 0..WIDTH {
                    for (values, factor) in values.iter_mut().zip(roughness.factors(random)) {
                        values.0[lane] *= factor;
                    }
                }
            }
            values
        });
        octets.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAMPLES: usize = 12;

    fn draw_many(missing_share: f32, dropout: Dropout) -> Vec<Vec<bool>> {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let draw = |_| draw_present(SAMPLES, missing_share, dropout, &mut random);
        (0..6_000).map(draw).collect()
    }

    fn is_prefix(present: &[bool]) -> bool {
        present.is_sorted_by(|one, next| one >= next)
    }

    #[test]
    fn tail_or_few_drops_last_readings_or_at_most_two() {
        let mut tails = [0; SAMPLES + 1];
        for present in draw_many(1.0, Dropout::TailOrFew) {
            let count = present.iter().filter(|present| **present).count();
            match is_prefix(&present) {
                true => tails[count] += 1,
                false => assert!(count + 2 >= SAMPLES, "{present:?}"),
            }
        }
        // About 4,000 of 6,000 scans end early: a share of `HALF_SHARE` after half of the readings, the others after
        // any number.
        let others = (4_000.0 * (1.0 - HALF_SHARE) / 11.0) as i32;
        let halved = (4_000.0 * HALF_SHARE) as i32 + others;
        assert_eq!((tails[0], tails[SAMPLES]), (0, 0));
        for (count, times) in tails.into_iter().enumerate().take(10).skip(1) {
            let expected = if count == SAMPLES / 2 { halved } else { others };
            let error = f64::from((times - expected).abs());
            assert!(error < 4.0 * f64::from(expected).sqrt(), "{count}: {times}");
        }
    }

    #[test]
    fn any_drops_each_reading_equally_often() {
        let complete = draw_many(0.25, Dropout::Any)
            .iter()
            .filter(|present| !present.contains(&false))
            .count();
        assert!((4_300..4_700).contains(&complete), "{complete}");
        let mut counts = [0; SAMPLES];
        for present in draw_many(1.0, Dropout::Any) {
            assert!(present.contains(&true) && present.contains(&false));
            for (count, present) in counts.iter_mut().zip(present) {
                *count += i32::from(present);
            }
        }
        // Each reading is missing in half of the tasks.
        assert!(
            counts.iter().all(|count| (count - 3_000).abs() < 200),
            "{counts:?}"
        );
        let mut random = ChaCha8Rng::seed_from_u64(1);
        assert_eq!(draw_present(1, 1.0, Dropout::Any, &mut random), [true]);
    }
}
