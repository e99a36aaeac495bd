//! What a training task is: a material that is like one that was measured, read with some noise, some
//! of it not at all.

use glimpse_core::fit::coefficient_net::MissingPolicy;
use glimpse_core::recipe::Noise;
use glimpse_kernels::lanes::WIDTH;
use glimpse_kernels::samples::OctetRgb;
use rand::Rng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::field::FIELD;
use super::highlight_warp::HighlightWarp;
use super::pool::WarpedPool;
use crate::meta::augmentation::Augmentation;
use crate::meta::start::standard_normal;

/// How much materials are varied in training, and readings spoilt.
#[derive(Clone, Debug, PartialEq)]
pub struct AugmentationOptions {
    /// The largest gain of a filter.
    pub gain: f32,
    /// Warps that highlights may have; the first one is none.
    pub warps: Vec<HighlightWarp>,
    /// How much the partner's share differs between channels.
    pub colored: f32,
    /// Standard deviation of the smooth fields' logarithms.
    pub field: f32,
    /// The share of tasks with missing readings.
    pub missing: f32,
    /// Noise of readings.
    pub noise: Noise,
}

impl Default for AugmentationOptions {
    /// What does best on materials that were not trained on.
    fn default() -> Self {
        // From 0.67 to 1.5 times as wide as they are.
        let others = [-1.0_f32, -0.67, -0.33, 0.33, 0.67, 1.0].map(|share| HighlightWarp {
            stretch: (0.4 * share).exp(),
        });
        Self {
            gain: 1.5,
            warps: std::iter::once(HighlightWarp::NONE).chain(others).collect(),
            colored: 0.3,
            field: 0.1,
            missing: 0.0,
            noise: Noise {
                multiplicative: 0.0,
                additive: 0.0,
                levels: 0,
            },
        }
    }
}

impl AugmentationOptions {
    /// What is learned to do where readings are missing.
    #[must_use]
    pub fn where_missing(&self) -> MissingPolicy {
        match self.missing > 0.0 {
            true => MissingPolicy::CountForMore,
            false => MissingPolicy::NoFit,
        }
    }
}

/// Some materials, and their share of all tasks.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// Which materials; one at least.
    pub materials: Vec<usize>,
    /// Their share; all shares together are 1.
    pub share: f32,
}

/// A material of a group that is chosen by its share.
fn any_of(groups: &[Group], random: &mut ChaCha8Rng) -> usize {
    let mut left: f32 = random.random();
    let mut chosen: &[usize] = &[];
    for group in groups {
        chosen = &group.materials;
        left -= group.share;
        if left < 0.0 {
            break;
        }
    }
    chosen[random.random_range(0..chosen.len())]
}

/// Which readings are lost, where some are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dropout {
    /// Any number of any of them: samples have no order yet.
    Any,
    /// Two times in three those after the first few, as the scan ended early; else one or two were lost.
    LastOrFew,
}

/// In how many scans that end early half of the readings are there: one recipe is to serve in place of that of
/// half as many samples, and a length that is one among many is hardly learned.
const HALVED: f32 = 0.2;

/// Which readings are there; some are missing in a share `missing` of all tasks.
fn present(samples: usize, missing: f32, which: Dropout, random: &mut ChaCha8Rng) -> Vec<bool> {
    let mut present = vec![true; samples];
    if samples < 2 || random.random::<f32>() >= missing {
        return present;
    }
    if which == Dropout::LastOrFew && random.random_range(0..3) == 0 {
        for _ in 0..random.random_range(1..=2.min(samples - 1)) {
            present[random.random_range(0..samples)] = false;
        }
        return present;
    }
    let first = match which == Dropout::LastOrFew && random.random::<f32>() < HALVED {
        true => samples / 2,
        false => random.random_range(1..samples),
    };
    present[first..].fill(false);
    if which == Dropout::Any {
        present.shuffle(random);
    }
    present
}

/// A task.
#[derive(Clone, Debug)]
pub struct Task {
    /// The material's index.
    pub material: usize,
    /// Which channel of the material each channel is.
    pub channels: [usize; 3],
    /// What it is multiplied by.
    pub gains: [f32; 3],
    /// The index of the material that it is mixed with.
    pub partner: usize,
    /// The partner's share in each channel.
    pub shares: [f32; 3],
    /// The warps of the material and of the partner, by number.
    pub warps: [usize; 2],
    /// Coefficients of the smooth field.
    pub field: [f32; FIELD],
    /// Which readings are there.
    pub present: Vec<bool>,
    /// What each reading is multiplied by, and what is added to it.
    pub noise: Vec<[[f32; 3]; 2]>,
    /// Octets of directions that it is judged at.
    pub octets: Vec<u32>,
}

impl Task {
    /// A material as it is, all readings taken, judged everywhere.
    #[must_use]
    pub fn plain(material: usize, samples: usize, octets: usize) -> Self {
        Self {
            material,
            channels: [0, 1, 2],
            gains: [1.0; 3],
            partner: material,
            shares: [0.0; 3],
            warps: [0; 2],
            field: [0.0; FIELD],
            present: vec![true; samples],
            noise: Vec::new(),
            octets: (0..octets as u32).collect(),
        }
    }

    /// A random one.
    #[must_use]
    pub fn random(
        pool: &WarpedPool,
        groups: &[Group],
        variety: &AugmentationOptions,
        [samples, outer]: [usize; 2],
        lost: Dropout,
        random: &mut ChaCha8Rng,
    ) -> Self {
        let octets = pool.octets();
        let [material, partner] = [(); 2].map(|()| any_of(groups, random));
        let Augmentation {
            order: channels,
            gains,
            share,
            ..
        } = Augmentation::random(variety.gain, 1, random);
        let warps = [material, partner].map(|index| random.random_range(0..pool.warps(index)));
        let shares = [(); 3].map(|()| {
            let apart = variety.colored * (2.0 * random.random::<f32>() - 1.0);
            (share + apart).clamp(0.0, 1.0)
        });
        let field = [(); FIELD].map(|()| variety.field * standard_normal(random));
        let present = present(samples, variety.missing, lost, random);
        let Noise {
            multiplicative,
            additive,
            ..
        } = variety.noise;
        let noise = match multiplicative + additive > 0.0 {
            true => (0..samples)
                .map(|_| {
                    let factor = [(); 3].map(|()| 1.0 + multiplicative * standard_normal(random));
                    [factor, [(); 3].map(|()| additive * standard_normal(random))]
                })
                .collect(),
            false => Vec::new(),
        };
        let judged = (0..outer.div_ceil(WIDTH)).map(|_| random.random_range(0..octets as u32));
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
            octets: judged.collect(),
        }
    }

    /// What it counts for by its readings: the square root of the share that is taken. Fewer of them leave
    /// a larger loss, and the gradient would be mostly theirs.
    #[must_use]
    pub fn weight_of_readings(&self) -> f32 {
        let taken = self.present.iter().filter(|present| **present).count();
        (taken as f32 / self.present.len() as f32).sqrt()
    }

    /// True if there is no smooth field.
    #[must_use]
    pub fn is_flat(&self) -> bool {
        self.field == [0.0; FIELD]
    }

    /// True if nothing of a partner is in it.
    #[must_use]
    pub fn is_alone(&self) -> bool {
        self.shares == [0.0; 3]
    }

    /// The BRDF at the directions that it is judged at.
    #[must_use]
    pub fn values(&self, pool: &WarpedPool) -> Vec<OctetRgb> {
        let own = pool.values(self.material, self.warps[0]);
        let partner = pool.values(self.partner, self.warps[1]);
        let octets = self.octets.iter().map(|octet| {
            let (own, partner) = (&own[*octet as usize], &partner[*octet as usize]);
            let mut values = OctetRgb::default();
            let mut factor = [1.0; WIDTH];
            if !self.is_flat() {
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
            values
        });
        octets.collect()
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    const SAMPLES: usize = 12;

    fn drawn(missing: f32, which: Dropout) -> Vec<Vec<bool>> {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let one = |_| present(SAMPLES, missing, which, &mut random);
        (0..6_000).map(one).collect()
    }

    fn is_first_few(present: &[bool]) -> bool {
        present.is_sorted_by(|one, next| one >= next)
    }

    #[test]
    fn scans_end_early_or_lose_a_reading_or_two() {
        let mut first = [0; SAMPLES + 1];
        for present in drawn(1.0, Dropout::LastOrFew) {
            let there = present.iter().filter(|there| **there).count();
            match is_first_few(&present) {
                true => first[there] += 1,
                false => assert!(there + 2 >= SAMPLES, "{present:?}"),
            }
        }
        // 4,000 times in all: a fifth of them at half of the samples, and the others at any number.
        let others = (4_000.0 * (1.0 - HALVED) / 11.0) as i32;
        let halved = (4_000.0 * HALVED) as i32 + others;
        assert_eq!((first[0], first[SAMPLES]), (0, 0));
        for (there, times) in first.into_iter().enumerate().take(10).skip(1) {
            let expected = if there == SAMPLES / 2 { halved } else { others };
            let error = f64::from((times - expected).abs());
            assert!(error < 4.0 * f64::from(expected).sqrt(), "{there}: {times}");
        }
    }

    #[test]
    fn any_may_be_missing_as_often_as_is_asked_for() {
        let all = |there: &Vec<bool>| there.iter().all(|there| *there);
        let whole = drawn(0.25, Dropout::Any)
            .iter()
            .filter(|each| all(each))
            .count();
        assert!((4_300..4_700).contains(&whole), "{whole}");
        let mut there = [0; SAMPLES];
        for present in drawn(1.0, Dropout::Any) {
            assert!(present.contains(&true) && present.contains(&false));
            for (count, present) in there.iter_mut().zip(present) {
                *count += i32::from(present);
            }
        }
        // Half of them in the mean, wherever they are.
        assert!(
            there.iter().all(|count| (count - 3_000).abs() < 200),
            "{there:?}"
        );
        assert!(present(1, 1.0, Dropout::Any, &mut ChaCha8Rng::seed_from_u64(1))[0]);
    }
}
