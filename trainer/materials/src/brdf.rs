//! The interface of every BRDF: materials, fits and functions.

use glimpse_core::geometry::{Angles, HalfDifference};

use crate::NotFinite;
use crate::basis::{Reconstruction, angles_of};

/// A BRDF that metrics and pictures evaluate at many directions in one call.
pub trait Brdf: Sync {
    /// Evaluates the BRDF in linear RGB, sr^-1 (not times the cosine), at each element of `at`. Writes the
    /// values to `brdf`, which has the same length; NaN where the BRDF is unknown.
    ///
    /// Each of this method and [`Brdf::at_angles`] has a default that calls the other one: implement at least one.
    fn evaluate(&self, at: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]) {
        for (at, brdf) in at.iter().zip(brdf) {
            *brdf = self.at_angles(angles_of(at));
        }
    }

    /// Returns the BRDF in linear RGB, sr^-1 (not times the cosine), at angles in radians; NaN where it is unknown.
    ///
    /// The default converts the angles to a pair of directions. Materials use the angles instead: at theta_d = 0, the
    /// pair does not determine phi_d, and a table may hold a different value for each phi_d.
    fn at_angles(&self, angles: Angles<f32>) -> [f32; 3] {
        let mut brdf = [[0.0; 3]];
        self.evaluate(&[HalfDifference::from_angles(angles)], &mut brdf);
        brdf[0]
    }

    /// Returns the values of [`Brdf::evaluate`] at each element of `at`.
    fn values_at(&self, at: &[HalfDifference<f32>]) -> Vec<[f32; 3]> {
        let mut values = vec![[0.0; 3]; at.len()];
        self.evaluate(at, &mut values);
        values
    }

    /// Returns [`Brdf::values_at`].
    ///
    /// # Errors
    /// If a value is not finite.
    fn finite_values_at(&self, at: &[HalfDifference<f32>]) -> Result<Vec<[f32; 3]>, NotFinite> {
        let values = self.values_at(at);
        for (at, value) in at.iter().zip(&values) {
            NotFinite::check(angles_of(at), *value)?;
        }
        Ok(values)
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
