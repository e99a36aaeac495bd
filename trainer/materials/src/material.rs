//! The interface of every material.

use glimpse_core::geometry::Angles;
use glimpse_core::model::NeuralParameters;

use crate::{Bands, Brdf, Coverage, SourceError};

/// A material: a named [`Brdf`] with derivatives. It is defined for all directions unless [`Material::coverage`] states unknown
/// ones.
pub trait Material: Brdf + Send {
    /// Returns the name. Files of fitted materials and PAB-Opto files contain it. For other files, it is the stem of
    /// the file name.
    fn name(&self) -> &str;

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
