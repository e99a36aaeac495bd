//! The virtual instrument of evaluations: readings of a material, with noise, quantization and missing readings.

use std::f32::consts::FRAC_1_PI;
use std::sync::Arc;

use clap::Args;
use clap::builder::RangedI64ValueParser;
use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::recipe::Recipe;
use glimpse_fitting::linear::{Aperture, PosteriorReading};
use glimpse_fitting::recipe::ReadingNoise;
use glimpse_materials::Material;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

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
    /// Checks that shares are within 0 to 1, that readings remain of this number of samples, and that the recipe, if any,
    /// tolerates missing ones.
    ///
    /// # Errors
    /// [`EvaluationError::Share`], [`EvaluationError::NoReadings`], [`EvaluationError::NeedsAllReadings`] or
    /// [`EvaluationError::TooFewReadings`].
    pub fn validate(
        &self,
        samples: usize,
        recipe: Option<&Recipe<'_>>,
    ) -> Result<(), EvaluationError> {
        for (name, share) in [("noise", self.noise), ("additive", self.additive)] {
            if !(0.0..=1.0).contains(&share) {
                return Err(EvaluationError::Share(name, share));
            }
        }
        let first = self.first.unwrap_or(samples);
        if self.lost >= first.min(samples) {
            let (first, lost) = (first.min(samples), self.lost);
            return Err(EvaluationError::NoReadings { first, lost });
        }
        let has_missing = self.first.is_some() || self.lost > 0;
        if has_missing && recipe.is_some_and(|recipe| !recipe.tolerates_missing()) {
            return Err(EvaluationError::NeedsAllReadings);
        }
        if first > samples {
            return Err(EvaluationError::TooFewReadings { first, samples });
        }
        Ok(())
    }

    /// Returns true if the degradation depends on a seed.
    #[must_use]
    pub fn is_random(&self) -> bool {
        self.lost > 0 || self.sensor_noise().is_random()
    }

    fn sensor_noise(&self) -> ReadingNoise {
        ReadingNoise {
            multiplicative: self.noise,
            additive: self.additive * FRAC_1_PI,
            levels: self.levels,
        }
    }

    /// Returns a reader of a material at the samples of a pattern. `samples` is their number. The seed determines the
    /// dropped readings and the noise.
    #[must_use]
    pub fn reader<'m>(&self, material: &'m dyn Material, samples: usize, seed: u64) -> Reader<'m> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut present = vec![true; self.first.map_or(samples, |first| first.min(samples))];
        // Without lost readings, the noise does not depend on the number of readings.
        if self.lost > 0 {
            let mut lost: Vec<usize> = (0..present.len()).collect();
            lost.shuffle(&mut random);
            for index in lost.into_iter().take(self.lost) {
                present[index] = false;
            }
        }
        Reader {
            material,
            displaced: &[],
            apertures: &[],
            present,
            noise: self.sensor_noise(),
            random,
        }
    }
}

/// A virtual instrument that reads a material.
pub struct Reader<'m> {
    /// The material.
    pub material: &'m dyn Material,
    /// The directions at which samples are really read, by index; those that are requested if there is none.
    pub displaced: &'m [Angles<f32>],
    /// The apertures of samples, by index; none for exact directions.
    pub apertures: &'m [Option<Arc<Aperture>>],
    /// True for each reading that is not missing.
    present: Vec<bool>,
    noise: ReadingNoise,
    random: ChaCha8Rng,
}

impl Reader<'_> {
    /// Reads a sample, given its index and angles. Call it in increasing order of the index.
    ///
    /// Returns the BRDF in linear RGB, sr^-1, not times the cosine, or None if the reading is missing.
    pub fn read(&mut self, index: usize, angles: Angles<f32>) -> Option<[f32; 3]> {
        if !*self.present.get(index)? {
            return None;
        }
        let angles = *self.displaced.get(index).unwrap_or(&angles);
        let cos_theta_i = HalfDifference::from_angles(angles).cos_theta_i();
        let brdf = match self.aperture(index) {
            Some(aperture) => aperture.mean(self.material),
            None => self.material.at_angles(angles),
        };
        Some(self.noise.read(brdf, cos_theta_i, &mut self.random))
    }

    fn aperture(&self, index: usize) -> Option<&Arc<Aperture>> {
        self.apertures.get(index)?.as_ref()
    }

    /// Reads a sample, as [`read`](Self::read), for a posterior, which knows the noise relative to the reading.
    pub(super) fn posterior_reading(
        &mut self,
        index: usize,
        angles: Angles<f32>,
    ) -> Option<PosteriorReading> {
        let brdf = self.read(index, angles)?;
        let mut reading = PosteriorReading::new(angles, brdf);
        reading.aperture = self.aperture(index).cloned();
        if self.noise.multiplicative > 0.0 {
            reading.noise = self.noise.multiplicative;
        }
        Some(reading)
    }

    /// Reads samples at all of these angles, without the missing ones.
    pub fn read_all(&mut self, angles: &[Angles<f32>]) -> Vec<(Angles<f32>, [f32; 3])> {
        let readings = angles.iter().enumerate();
        let readings = readings.map(|(index, angles)| Some((*angles, self.read(index, *angles)?)));
        readings.flatten().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glimpse_materials::Procedural;

    fn read(degradation: Degradation, seed: u64) -> Vec<Option<[f32; 3]>> {
        let material = Procedural::set(1, 3).remove(0);
        let angles = Angles::from_array([0.3, 0.4, 1.0]);
        let mut reader = degradation.reader(&material, 8, seed);
        (0..8).map(|index| reader.read(index, angles)).collect()
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
