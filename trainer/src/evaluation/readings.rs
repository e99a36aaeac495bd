//! What becomes of readings before a recipe fits them: some are lost, all are noisy.

use std::f32::consts::FRAC_1_PI;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_materials::{Material, quantized};
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// What becomes of readings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Readings {
    /// Only so many of the first ones are taken.
    pub first: Option<usize>,
    /// So many of those, any of them, are lost.
    pub lost: usize,
    /// Standard deviation of the noise relative to the value.
    pub noise: f32,
    /// Standard deviation of the noise besides, as a share of the BRDF of a white surface, 1/pi.
    pub additive: f32,
    /// Levels that the sensor tells apart; see [`quantized`].
    pub levels: u32,
}

impl Readings {
    /// True if some are missing.
    #[must_use]
    pub fn are_missing(&self) -> bool {
        self.first.is_some() || self.lost > 0
    }

    /// True if they depend on a seed.
    #[must_use]
    pub fn are_random(&self) -> bool {
        self.lost > 0 || self.noise > 0.0 || self.additive > 0.0
    }

    /// What is read of a material at so many samples, by their index and angles, asked for in order: the
    /// BRDF in linear RGB, sr^-1, not times the cosine, or None where a reading is lost. The same seed
    /// loses the same ones, with the same noise.
    pub fn of<'m>(
        self,
        material: &'m dyn Material,
        samples: usize,
        seed: u64,
    ) -> impl FnMut(u16, Angles<f32>) -> Option<[f32; 3]> + 'm {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let taken = self.first.map_or(samples, |first| first.min(samples));
        let mut lost: Vec<usize> = (0..taken).collect();
        lost.shuffle(&mut random);
        lost.truncate(self.lost);
        move |index, angles| {
            let index = usize::from(index);
            if index >= taken || lost.contains(&index) {
                return None;
            }
            let mut brdf = material.brdf(angles);
            if self.noise > 0.0 || self.additive > 0.0 {
                for value in &mut brdf {
                    let [relative, added]: [f32; 2] =
                        [(); 2].map(|()| random.sample(StandardNormal));
                    *value *= 1.0 + self.noise * relative;
                    *value += self.additive * FRAC_1_PI * added;
                }
            }
            let cos_theta_i = HalfDifference::from_angles(angles).cos_theta_i();
            Some(brdf.map(|value| quantized(value, cos_theta_i, self.levels)))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glimpse_materials::Procedural;

    fn read(readings: Readings, seed: u64) -> Vec<Option<[f32; 3]>> {
        let material = Procedural::set(1, 3).remove(0);
        let angles = Angles {
            theta_h: 0.3,
            theta_d: 0.4,
            phi_d: 1.0,
        };
        let mut read = readings.of(&material, 8, seed);
        (0..8).map(|index| read(index, angles)).collect()
    }

    #[test]
    fn as_many_are_missing_as_are_asked_for() {
        let readings = Readings {
            first: Some(6),
            lost: 2,
            ..Readings::default()
        };
        let mut seen = [0; 8];
        for seed in 0..200 {
            let found = read(readings, seed);
            assert_eq!(found.iter().flatten().count(), 4);
            assert_eq!(&found[6..], [None, None]);
            for (count, found) in seen.iter_mut().zip(found) {
                *count += usize::from(found.is_some());
            }
        }
        assert!(
            seen[..6].iter().all(|count| (100..170).contains(count)),
            "{seen:?}"
        );
        assert_eq!(read(Readings::default(), 0).iter().flatten().count(), 8);
    }

    #[test]
    fn noise_has_the_deviation_that_is_asked_for() {
        let [plain, ..] = read(Readings::default(), 0)[0].expect("it is read");
        for (noise, additive) in [(0.1, 0.0), (0.0, 0.1)] {
            let readings = Readings {
                noise,
                additive,
                ..Readings::default()
            };
            let all = (0..500).flat_map(|seed| read(readings, seed));
            let errors: Vec<f32> = all.flatten().map(|[red, ..]| red - plain).collect();
            let square = errors.iter().map(|error| error * error).sum::<f32>();
            let deviation = (square / errors.len() as f32).sqrt();
            let expected = noise * plain + additive * FRAC_1_PI;
            assert!(
                (deviation / expected - 1.0).abs() < 0.05,
                "{deviation} {expected}"
            );
        }
    }
}
