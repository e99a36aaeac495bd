//! The interface of every material.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::NeuralParameters;

use crate::basis::angles_of;

/// A measured material: a BRDF that can be looked up anywhere, with its derivative.
pub trait Material: Send + Sync {
    /// Its name: the stem of the file it was read from.
    fn name(&self) -> &str;

    /// The BRDF in linear RGB, sr^-1 (not times the cosine), at angles in radians.
    fn brdf(&self, angles: Angles<f32>) -> [f32; 3];

    /// The BRDF, and its derivative by theta_h, theta_d and phi_d for each channel.
    fn brdf_with_derivative(&self, angles: Angles<f32>) -> ([f32; 3], [[f32; 3]; 3]);

    /// The same at many angles at once; `found` is as long as `angles`.
    fn brdf_batch_with_derivative(
        &self,
        angles: &[Angles<f32>],
        found: &mut [([f32; 3], [[f32; 3]; 3])],
    ) {
        for (angles, found) in angles.iter().zip(found) {
            *found = self.brdf_with_derivative(*angles);
        }
    }

    /// True if the BRDF is the same, but for rounding, wherever light and sensor are exchanged: at
    /// phi_d + pi.
    fn is_reciprocal(&self) -> bool {
        false
    }

    /// The weights, if it is a network of the model Neural, which files of networks hold to the bit.
    fn network(&self) -> Option<NeuralParameters<f32>> {
        None
    }

    /// The BRDF at many places at once, for pictures and metrics.
    fn brdf_batch(&self, at: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]) {
        for (at, brdf) in at.iter().zip(brdf) {
            *brdf = self.brdf(angles_of(at));
        }
    }

    /// Lets go of what of its file lies in memory, after a look at many places; it is read again
    /// where it is needed again. Most materials are small, and do nothing.
    fn release(&self) {}
}
