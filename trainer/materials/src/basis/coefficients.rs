//! From what a device ends in to a BRDF.

use super::Coefficients;
use super::table::{Basis, Reconstruction};

/// Another number of coefficients than the basis has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "a fit by this basis ends in {expected} coefficients, but there are {found}: they belong to \
     another recipe, or some are missing"
)]
pub struct CoefficientCountError {
    /// Three times the basis's components.
    pub expected: usize,
    /// How many there are.
    pub found: usize,
}

impl Basis {
    /// The coefficients of each channel among those that a device ends in: m of red, m of green, m of
    /// blue.
    ///
    /// # Errors
    /// If there are not 3 m.
    pub fn channels(&self, values: &[f32]) -> Result<Coefficients, CoefficientCountError> {
        let components = self.components();
        if values.len() != 3 * components {
            return Err(CoefficientCountError {
                expected: 3 * components,
                found: values.len(),
            });
        }
        let channel = |index: usize| {
            let values = &values[index * components..][..components];
            values.iter().copied().map(f64::from).collect()
        };
        Ok([channel(0), channel(1), channel(2)])
    }

    /// The whole BRDF of those coefficients.
    ///
    /// # Errors
    /// If there are not 3 m.
    pub fn reconstruct_values(
        &self,
        values: &[f32],
    ) -> Result<Reconstruction, CoefficientCountError> {
        Ok(self.reconstruct(&self.channels(values)?))
    }
}
