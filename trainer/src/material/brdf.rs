//! A BRDF, whatever it comes from.

use glimpse_core::geometry::HalfDifference;

use super::Material;

/// A BRDF that can be looked up at many places at once, as metrics and pictures do: a material, what
/// a fit has found, or a function of one place.
pub trait Brdf: Sync {
    /// The BRDF in linear RGB, sr^-1 (not times the cosine), at each of `at`; `brdf` is as long.
    fn evaluate(&self, at: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]);
}

impl Brdf for dyn Material + '_ {
    fn evaluate(&self, at: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]) {
        self.brdf_batch(at, brdf);
    }
}

impl<F: Fn(&HalfDifference<f32>) -> [f32; 3] + Sync + ?Sized> Brdf for F {
    fn evaluate(&self, at: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]) {
        for (at, brdf) in at.iter().zip(brdf) {
            *brdf = self(at);
        }
    }
}
