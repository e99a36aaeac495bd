//! Coefficients of a device's fit, and their BRDF.

use super::Coefficients;
use super::table::{Basis, Reconstruction};

/// A number of coefficients that does not match the basis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "there are {actual} coefficients, and this basis needs {expected}; give all coefficients, and the basis of the \
     recipe that the device fitted with"
)]
pub struct CoefficientCountError {
    /// Three times the number of components of the basis.
    pub expected: usize,
    /// The number of coefficients.
    pub actual: usize,
}

impl Basis {
    /// Splits the coefficients of a device's fit by channel: m of red, m of green, m of blue, where m is the
    /// number of components.
    ///
    /// # Errors
    /// If the number of values is not 3 m.
    pub fn channels(&self, values: &[f32]) -> Result<Coefficients, CoefficientCountError> {
        let components = self.components();
        if values.len() != 3 * components {
            return Err(CoefficientCountError {
                expected: 3 * components,
                actual: values.len(),
            });
        }
        let channel = |index: usize| {
            let values = &values[index * components..][..components];
            values.iter().copied().map(f64::from).collect()
        };
        Ok([channel(0), channel(1), channel(2)])
    }

    /// Tabulates the BRDF of the coefficients of a device's fit: m of red, m of green, m of blue.
    ///
    /// # Errors
    /// If the number of values is not 3 m.
    pub fn reconstruct_values(
        &self,
        values: &[f32],
    ) -> Result<Reconstruction, CoefficientCountError> {
        Ok(self.reconstruct(&self.channels(values)?))
    }
}
