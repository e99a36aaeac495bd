//! Variations of materials: there are far more of them than materials, and each is one too.

use rand::Rng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

/// A material seen through a filter, and mixed with another one.
///
/// Each channel is another one of the material, times a gain; of that, and of a partner as it is,
/// the BRDF is a mean. (A mean of two BRDFs is one: it is reciprocal, and reflects no more light
/// than they do.)
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Augmentation {
    /// Which channel of the material each channel is.
    pub order: [usize; 3],
    /// What it is multiplied by.
    pub gains: [f32; 3],
    /// The index of the partner.
    pub partner: usize,
    /// The partner's share, in \[0, 1\].
    pub share: f32,
}

impl Augmentation {
    /// Channels in random order; gains between 1 / `gain` and `gain`: one for all channels, and
    /// the square root of the range for each; any of so many `partners`, and any share.
    #[must_use]
    pub fn random(gain: f32, partners: usize, random: &mut ChaCha8Rng) -> Self {
        let mut order = [0, 1, 2];
        order.shuffle(random);
        let reach = gain.ln();
        let mut log_gain = |reach: f32| reach * (2.0 * random.random::<f32>() - 1.0);
        let shared = log_gain(reach);
        let gains = [0; 3].map(|_| (shared + log_gain(0.5 * reach)).exp());
        Self {
            order,
            gains,
            partner: random.random_range(0..partners),
            share: random.random(),
        }
    }

    /// The BRDF at a place where the material's and the partner's are known.
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
    fn channels_change_places_and_a_partner_takes_its_share() {
        let augmentation = Augmentation {
            order: [2, 0, 1],
            gains: [1.0, 2.0, 4.0],
            partner: 0,
            share: 0.25,
        };
        let found = augmentation.brdf([1.0, 2.0, 3.0], [4.0, 8.0, 12.0]);
        assert_eq!(
            found,
            [0.75 * 3.0 + 1.0, 0.75 * 2.0 + 2.0, 0.75 * 8.0 + 3.0]
        );
    }

    #[test]
    fn random_ones_stay_in_their_range_and_use_it() {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let all: Vec<_> = (0..2_000)
            .map(|_| Augmentation::random(2.0, 3, &mut random))
            .collect();
        let most = 2.0_f32.powf(1.5);
        let gains = || all.iter().flat_map(|augmentation| augmentation.gains);
        assert!(gains().all(|gain| (1.0 / most..most).contains(&gain)));
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
