//! Coefficients of a device's fit, and their BRDF.

use super::Coefficients;
use super::table::{Basis, Reconstruction};

/// The number of coefficients does not match the basis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{actual} coefficients, and this basis needs {expected}; use the basis of the recipe of the fit, and all \
     coefficients"
)]
pub struct CoefficientCountError {
    /// Three times the number of the basis's components.
    pub expected: usize,
    /// The number of coefficients.
    pub actual: usize,
}

impl Basis {
    /// Splits the coefficients of a device's fit by channel: m of red, m of green, m of blue.
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
