//! A BRDF, whatever it comes from.

use glimpse_core::geometry::{Angles, HalfDifference};

use crate::Material;
use crate::basis::{Reconstruction, angles_of};

/// A BRDF that can be looked up at many places at once, as metrics and pictures do: a material, what
/// a fit has found, or a function of one place.
pub trait Brdf: Sync {
    /// The BRDF in linear RGB, sr^-1 (not times the cosine), at each of `at`; `brdf` is as long.
    fn evaluate(&self, at: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]);

    /// The same at angles in radians. (Where a table has values that no pair of directions tells
    /// apart, as at theta_d = 0, these do.)
    fn at_angles(&self, angles: Angles<f32>) -> [f32; 3] {
        let mut brdf = [[0.0; 3]];
        self.evaluate(&[HalfDifference::from_angles(angles)], &mut brdf);
        brdf[0]
    }
}

impl Brdf for dyn Material + '_ {
    fn evaluate(&self, at: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]) {
        self.brdf_batch(at, brdf);
    }

    fn at_angles(&self, angles: Angles<f32>) -> [f32; 3] {
        self.brdf(angles)
    }
}

impl<F: Fn(&HalfDifference<f32>) -> [f32; 3] + Sync + ?Sized> Brdf for F {
    fn evaluate(&self, at: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]) {
        for (at, brdf) in at.iter().zip(brdf) {
            *brdf = self(at);
        }
    }
}

impl Brdf for Reconstruction {
    fn evaluate(&self, at: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]) {
        for (at, brdf) in at.iter().zip(brdf) {
            let weight = f64::from(at.cos_theta_i()) * f64::from(at.cos_theta_o());
            *brdf = self.brdf(&angles_of(at), weight);
        }
    }
}
