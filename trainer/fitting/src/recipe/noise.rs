//! The noise of readings.

use glimpse_materials::quantize;
use rand::Rng;
use rand_distr::StandardNormal;
use serde::Serialize;

/// The noise of readings, independent for each channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ReadingNoise {
    /// The standard deviation relative to the reading, 0 or more.
    pub multiplicative: f32,
    /// The standard deviation of the additive noise in sr⁻¹ (of the BRDF, not times the cosine), 0 or more.
    pub additive: f32,
    /// The number of levels of the sensor from darkness to a white surface (BRDF 1/π) that faces the light; 0 without
    /// quantization.
    pub levels: u32,
}

impl ReadingNoise {
    /// Returns true if readings vary.
    #[must_use]
    pub fn is_random(&self) -> bool {
        self.multiplicative > 0.0 || self.additive > 0.0
    }

    /// Returns a noisy reading of a BRDF (sr⁻¹, not times the cosine) at a direction with this cosine of theta_i.
    pub fn read(&self, brdf: [f32; 3], cos_theta_i: f32, random: &mut impl Rng) -> [f32; 3] {
        brdf.map(|mut value| {
            if self.is_random() {
                let [multiplicative, additive]: [f32; 2] =
                    [(); 2].map(|()| random.sample(StandardNormal));
                value *= 1.0 + self.multiplicative * multiplicative;
                value += self.additive * additive;
            }
            quantize(value, cos_theta_i, self.levels)
        })
    }
}
