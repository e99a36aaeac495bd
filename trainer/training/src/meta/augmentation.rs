//! Augmentation: random variations of the training materials.

use rand::Rng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

/// An augmented material: the material seen through a color filter, mixed with a partner material.
///
/// Each channel takes one channel of the material, times a gain. The augmented BRDF is a weighted mean of the filtered
/// material and the unfiltered partner. A mean of two BRDFs is a BRDF: it is reciprocal, and reflects no more light
/// than they do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Augmentation {
    /// The source channel of each channel.
    pub order: [usize; 3],
    /// The gain of each channel.
    pub gains: [f32; 3],
    /// The index of the partner.
    pub partner: usize,
    /// The partner's weight, in \[0, 1\].
    pub share: f32,
}

impl Augmentation {
    /// Draws an augmentation: channels in random order, random gains, one of `partners` materials, and a share uniform
    /// in \[0, 1).
    ///
    /// Each gain is the product of a shared factor and a factor per channel. The shared factor is between 1 / `gain`
    /// and `gain`, the factor per channel between the square roots of these bounds.
    #[must_use]
    pub fn random(gain: f32, partners: usize, random: &mut ChaCha8Rng) -> Self {
        let mut order = [0, 1, 2];
        order.shuffle(random);
        let bound = gain.ln();
        let mut log_gain = |bound: f32| bound * (2.0 * random.random::<f32>() - 1.0);
        let shared = log_gain(bound);
        let gains = [0; 3].map(|_| (shared + log_gain(0.5 * bound)).exp());
        Self {
            order,
            gains,
            partner: random.random_range(0..partners),
            share: random.random(),
        }
    }

    /// Returns the augmented BRDF, sr⁻¹, given the BRDFs of the material and the partner at the same directions.
    #[inline]
    #[must_use]
    pub fn brdf(&self, material: [f32; 3], partner: [f32; 3]) -> [f32; 3] {
        std::array::from_fn(|channel| {
            let filtered = self.gains[channel] * material[self.order[channel]];
            (1.0 - self.share) * filtered + self.share * partner[channel]
        })
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    #[test]
    fn brdf_mixes_permuted_channels_with_partner() {
        let augmentation = Augmentation {
            order: [2, 0, 1],
            gains: [1.0, 2.0, 4.0],
            partner: 0,
            share: 0.25,
        };
        let brdf = augmentation.brdf([1.0, 2.0, 3.0], [4.0, 8.0, 12.0]);
        assert_eq!(brdf, [0.75 * 3.0 + 1.0, 0.75 * 2.0 + 2.0, 0.75 * 8.0 + 3.0]);
    }

    #[test]
    fn random_augmentations_cover_their_range() {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let all: Vec<_> = (0..2_000)
            .map(|_| Augmentation::random(2.0, 3, &mut random))
            .collect();
        let max = 2.0_f32.powf(1.5);
        let gains = || all.iter().flat_map(|augmentation| augmentation.gains);
        assert!(gains().all(|gain| (1.0 / max..max).contains(&gain)));
        assert!(gains().any(|gain| gain > 2.0) && gains().any(|gain| gain < 0.5));
        for augmentation in &all {
            let mut order = augmentation.order;
            order.sort_unstable();
            assert_eq!(order, [0, 1, 2]);
            assert!((0.0..1.0).contains(&augmentation.share));
        }
        for partner in 0..3 {
            let count = all
                .iter()
                .filter(|augmentation| augmentation.partner == partner);
            assert!((550..800).contains(&count.count()), "partner {partner}");
        }
    }
}
