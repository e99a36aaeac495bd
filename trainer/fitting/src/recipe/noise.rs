//! The noise of readings in training.

use serde::Serialize;

/// The noise of readings in training, independent for each channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Noise {
    /// The standard deviation relative to the reading, 0 or more.
    pub multiplicative: f32,
    /// The standard deviation of the additive noise in sr⁻¹ (of the BRDF, not times the cosine), 0 or more.
    pub additive: f32,
    /// The number of levels of the sensor from darkness to a white surface (BRDF 1/π) that faces the light; 0 without
    /// quantization.
    pub levels: u32,
}
