//! Simulated degradation of readings: missing readings, noise and quantization.

use std::f32::consts::FRAC_1_PI;

use clap::Args;
use clap::builder::RangedI64ValueParser;
use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_materials::{Material, quantize};
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::EvaluationError;

/// A degradation of readings before a fit.
#[derive(Args, Clone, Copy, Debug, Default, PartialEq)]
pub struct Degradation {
    /// Number of readings to use, from the start of each recipe's pattern, 1 to 4096 [default: all]
    #[arg(long, value_name = "K", value_parser = RangedI64ValueParser::<usize>::new().range(1..=4096))]
    pub first: Option<usize>,
    /// Number of random readings of each material to drop, 0 to 4096
    #[arg(
        id = "lose",
        long = "lose",
        value_name = "K",
        default_value_t = 0,
        value_parser = RangedI64ValueParser::<usize>::new().range(0..=4096)
    )]
    pub lost: usize,
    /// Standard deviation of the readings' noise, relative to each value, 0 to 1: 0.02 is 2 %
    #[arg(long, value_name = "S", default_value_t = 0.0)]
    pub noise: f32,
    /// Standard deviation of noise that does not depend on the value, relative to the BRDF 1/pi
    /// of a white surface, 0 to 1: 0.01 is 1 %
    #[arg(long, value_name = "S", default_value_t = 0.0)]
    pub additive: f32,
    /// Number of quantization levels of the sensor between darkness and a white surface that faces
    /// the light; 0 for no quantization
    #[arg(long, value_name = "COUNT", default_value_t = 0)]
    pub levels: u32,
}

impl Degradation {
    /// Checks that shares are within 0 to 1, and that readings of a recipe with this number of samples remain.
    ///
    /// # Errors
    /// [`EvaluationError::Share`] or [`EvaluationError::NoReadings`].
    pub fn validate(&self, samples: usize) -> Result<(), EvaluationError> {
        for (name, share) in [("noise", self.noise), ("additive", self.additive)] {
            if !(0.0..=1.0).contains(&share) {
                return Err(EvaluationError::Share(name, share));
            }
        }
        let first = self.first.unwrap_or(samples).min(samples);
        match self.lost < first {
            true => Ok(()),
            false => Err(EvaluationError::NoReadings {
                first,
                lost: self.lost,
            }),
        }
    }

    /// Returns true if the degradation depends on a seed.
    #[must_use]
    pub fn is_random(&self) -> bool {
        self.lost > 0 || self.noise > 0.0 || self.additive > 0.0
    }

    /// Returns a function that reads a material at the samples of a pattern. `samples` is their number.
    ///
    /// The function takes a sample's index and angles, and has to be called in increasing order of the index. It returns
    /// the BRDF in linear RGB, sr^-1, not times the cosine, or None if the reading is missing. The seed determines the
    /// dropped readings and the noise.
    pub fn reader<'m>(
        self,
        material: &'m dyn Material,
        samples: usize,
        seed: u64,
    ) -> impl FnMut(u16, Angles<f32>) -> Option<[f32; 3]> + 'm {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let available = self.first.map_or(samples, |first| first.min(samples));
        let mut lost: Vec<usize> = (0..available).collect();
        // Without lost readings, the noise does not depend on the number of readings.
        if self.lost > 0 {
            lost.shuffle(&mut random);
        }
        lost.truncate(self.lost);
        move |index, angles| {
            let index = usize::from(index);
            if index >= available || lost.contains(&index) {
                return None;
            }
            let mut brdf = material.at_angles(angles);
            if self.noise > 0.0 || self.additive > 0.0 {
                for value in &mut brdf {
                    let [multiplicative, additive]: [f32; 2] =
                        [(); 2].map(|()| random.sample(StandardNormal));
                    *value *= 1.0 + self.noise * multiplicative;
                    *value += self.additive * FRAC_1_PI * additive;
                }
            }
            let cos_theta_i = HalfDifference::from_angles(angles).cos_theta_i();
            Some(brdf.map(|value| quantize(value, cos_theta_i, self.levels)))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glimpse_materials::Procedural;

    fn read(degradation: Degradation, seed: u64) -> Vec<Option<[f32; 3]>> {
        let material = Procedural::set(1, 3).remove(0);
        let angles = Angles {
            theta_h: 0.3,
            theta_d: 0.4,
            phi_d: 1.0,
        };
        let mut read = degradation.reader(&material, 8, seed);
        (0..8).map(|index| read(index, angles)).collect()
    }

    #[test]
    fn loses_the_given_number_of_readings() {
        let degradation = Degradation {
            first: Some(6),
            lost: 2,
            ..Degradation::default()
        };
        let mut counts = [0; 8];
        for seed in 0..200 {
            let readings = read(degradation, seed);
            assert_eq!(readings.iter().flatten().count(), 4);
            assert_eq!(&readings[6..], [None, None]);
            for (count, reading) in counts.iter_mut().zip(readings) {
                *count += usize::from(reading.is_some());
            }
        }
        assert!(
            counts[..6].iter().all(|count| (100..170).contains(count)),
            "{counts:?}"
        );
        assert_eq!(read(Degradation::default(), 0).iter().flatten().count(), 8);
    }

    #[test]
    fn noise_has_the_given_deviation() {
        let [plain, ..] = read(Degradation::default(), 0)[0].expect("no reading is missing");
        for (noise, additive) in [(0.1, 0.0), (0.0, 0.1)] {
            let degradation = Degradation {
                noise,
                additive,
                ..Degradation::default()
            };
            let readings = (0..500).flat_map(|seed| read(degradation, seed));
            let errors: Vec<f32> = readings.flatten().map(|[red, ..]| red - plain).collect();
            let sum_of_squares = errors.iter().map(|error| error * error).sum::<f32>();
            let deviation = (sum_of_squares / errors.len() as f32).sqrt();
            let expected = noise * plain + additive * FRAC_1_PI;
            assert!(
                (deviation / expected - 1.0).abs() < 0.05,
                "{deviation} {expected}"
            );
        }
    }
}
