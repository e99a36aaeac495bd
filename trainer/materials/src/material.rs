//! The interface of every material.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::NeuralParameters;

use crate::basis::angles_of;
use crate::{Bands, Brdf, Coverage, SourceError};

/// A material: a named BRDF with derivatives. It is defined for all directions unless [`Material::coverage`] states unknown
/// ones.
pub trait Material: Send + Sync {
    /// Returns the name. Files of fitted materials and PAB-Opto files contain it. For other files, it is the stem of
    /// the file name.
    fn name(&self) -> &str;

    /// Returns the BRDF in linear RGB, sr^-1 (not times the cosine), at angles in radians; NaN where it is unknown.
    fn brdf(&self, angles: Angles<f32>) -> [f32; 3];

    /// Returns the BRDF, and for each channel its derivatives with respect to theta_h, theta_d and phi_d.
    fn brdf_with_derivative(&self, angles: Angles<f32>) -> ([f32; 3], [[f32; 3]; 3]);

    /// Evaluates [`Material::brdf_with_derivative`] at many angles. `results` has the length of `angles`.
    fn brdf_batch_with_derivative(
        &self,
        angles: &[Angles<f32>],
        results: &mut [([f32; 3], [[f32; 3]; 3])],
    ) {
        for (angles, result) in angles.iter().zip(results) {
            *result = self.brdf_with_derivative(*angles);
        }
    }

    /// Returns the directions at which the material was measured.
    fn coverage(&self) -> Coverage {
        Coverage::Complete
    }

    /// Returns true if exchanging light and sensor (phi_d + pi) changes the BRDF by no more than rounding errors.
    fn is_reciprocal(&self) -> bool {
        false
    }

    /// Returns the weights if the material is a network of the model Neural. NBRDF files store them without loss.
    fn network(&self) -> Option<NeuralParameters<f32>> {
        None
    }

    /// Returns the spectrum if the material was measured in bands.
    fn spectrum(&self) -> Option<&Bands> {
        None
    }

    /// Evaluates the BRDF at many directions, for pictures and metrics. `brdf` has the length of `at`.
    fn brdf_batch(&self, at: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]) {
        for (at, brdf) in at.iter().zip(brdf) {
            *brdf = self.brdf(angles_of(at));
        }
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

impl dyn Material + '_ {
    /// Refuses a material whose BRDF is unknown at some directions.
    ///
    /// # Errors
    /// [`SourceError::Incomplete`].
    pub fn require_complete(&self) -> Result<(), SourceError> {
        match self.coverage() {
            coverage if coverage.unknown() > 0.0 => Err(SourceError::Incomplete {
                name: self.name().to_owned(),
                coverage,
            }),
            _ => Ok(()),
        }
    }
}
