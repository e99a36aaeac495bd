//! The interface of every material.

use glimpse_core::geometry::Angles;
use glimpse_core::model::NeuralParameters;

use crate::{Bands, Brdf, BrdfWithDerivative, Coverage, Omission, SourceError, have_color};

/// A material: a named [`Brdf`] with derivatives. It is defined for all directions unless [`Material::coverage`] states unknown
/// ones.
pub trait Material: Brdf + Send {
    /// Returns the name. Files of fitted materials and PAB-Opto files contain it. For other files, it is the stem of
    /// the file name.
    fn name(&self) -> &str;

    /// Returns the BRDF and its derivatives at each of these angles. The derivatives are NaN if they are unknown, as by
    /// default.
    fn with_derivatives(&self, angles: &[Angles<f32>]) -> Vec<BrdfWithDerivative> {
        let values = angles.iter().map(|angles| self.at_angles(*angles));
        values.map(|brdf| (brdf, [[f32::NAN; 3]; 3])).collect()
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

    /// Returns what the material lacks of its file: by default, the color of bands without one.
    fn omissions(&self) -> Vec<Omission> {
        let bands = self.spectrum();
        let invisible = bands.filter(|bands| !have_color(bands.wavelengths()));
        invisible.map(|_| Omission::Color).into_iter().collect()
    }
}

impl dyn Material + '_ {
    /// Returns sentences about unmeasured directions and [omissions](Material::omissions).
    #[must_use]
    pub fn remarks(&self) -> Vec<String> {
        let coverage = Some(self.coverage()).filter(|coverage| *coverage != Coverage::Complete);
        let coverage = coverage.iter().map(Coverage::to_string);
        let omissions = self.omissions();
        let omissions = omissions.iter().map(Omission::to_string);
        coverage.chain(omissions).collect()
    }

    /// Refuses a material whose BRDF is unknown at some directions.
    ///
    /// # Errors
    /// [`SourceError::Incomplete`].
    pub fn require_complete(&self) -> Result<(), SourceError> {
        let coverage = self.coverage();
        if coverage.unknown() > 0.0 {
            let name = self.name().to_owned();
            return Err(SourceError::Incomplete { name, coverage });
        }
        Ok(())
    }
}
