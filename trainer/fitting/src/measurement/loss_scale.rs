//! Losses to compare an expected loss with.

use glimpse_core::geometry::HalfDifference;
use glimpse_materials::Brdf;
use serde::Serialize;

use crate::linear::Posterior;

/// Losses to compare an expected loss with.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct LossScale {
    /// The loss of [`BLACK`](Self::BLACK).
    pub black: f64,
    /// The loss of a good fit: that of a learned pattern of 16 readings (docs/results.md, The next direction).
    pub good: f64,
    /// The loss with a color error on a sphere (CIEDE2000) of 1: Linear's with five lines of readings (docs/results.md,
    /// Readings at any directions).
    pub just_visible: f64,
}

impl LossScale {
    /// A BRDF that is 0 everywhere.
    pub const BLACK: &'static dyn Brdf = &|_: &HalfDifference<f32>| [0.0; 3];

    /// Creates the scale of materials against which [`BLACK`](Self::BLACK) has a loss.
    #[must_use]
    pub fn new(black: f64) -> Self {
        Self {
            black,
            good: 0.005,
            just_visible: 0.007,
        }
    }

    /// Creates the scale of the material of a posterior.
    #[must_use]
    pub fn of(posterior: &Posterior) -> Self {
        Self::new(f64::from(posterior.loss(Self::BLACK).loss))
    }
}
