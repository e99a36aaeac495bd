//! A scan on the host: core's own, by any recipe.

use glimpse_core::fit::AnyModel;
use glimpse_core::geometry::Angles;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{FinishError, FitError, Reading, ReadingError, Residual, Scan, ScanError};

/// Why a scan has no result: where a device would give up.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum HostScanError {
    /// A recipe cannot be scanned by.
    #[error(transparent)]
    Scan(#[from] ScanError),
    /// A material's value cannot be a reading.
    #[error("the material cannot be read: {0}")]
    Reading(#[from] ReadingError),
    /// A material's values cannot be fitted.
    #[error("the material cannot be fitted: {0}")]
    Fit(#[from] FitError),
    /// A material's fit has no result.
    #[error("the material cannot be fitted: {0}")]
    Finish(#[from] FinishError),
}

/// What a scan has found.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// A model's parameters in its order, or Linear's coefficients, m for red, m for green, m for
    /// blue.
    pub values: Vec<f32>,
    /// How well they explain the readings.
    pub residual: Residual,
    /// The loss that the fit is likely to have, where the recipe predicts one.
    pub predicted_loss: Option<f32>,
}

/// What reads a sample, by its index and angles in radians: the BRDF in linear RGB, sr^-1, not times
/// the cosine; None if nothing was read.
pub type Read<'r> = dyn FnMut(u16, Angles<f32>) -> Option<[f32; 3]> + 'r;

/// Reads where the recipe says, angles in radians, and fits, as the device does: `read` gives the
/// BRDF in linear RGB, sr^-1, not times the cosine.
///
/// # Errors
/// Where a device would give up.
pub fn scan(
    recipe: &Recipe<'_>,
    read: &mut dyn FnMut(Angles<f32>) -> [f32; 3],
) -> Result<Found, HostScanError> {
    scan_some(recipe, &mut |_, angles| Some(read(angles)))
}

/// The same, where some readings may be missing: `read` is told each sample's index, too.
///
/// # Errors
/// Where a device would give up, as it does where the recipe needs a reading that is missing.
pub fn scan_some(recipe: &Recipe<'_>, read: &mut Read<'_>) -> Result<Found, HostScanError> {
    let mut memory = vec![0.0; recipe.memory_words()];
    let mut scan = Scan::<AnyModel>::new(*recipe, &mut memory)?;
    for (index, angles) in (0..).zip(recipe.pattern()) {
        if let Some(brdf) = read(index, angles) {
            scan.record(index, Reading::new(brdf))?;
        }
    }
    let mut fit = scan.fit()?;
    while !fit.advance(u32::MAX).is_complete() {}
    match fit.finish() {
        // Simulated materials may be perfectly uniform, and a caller may want to see the worst.
        Ok(_) | Err(FinishError::Implausible(_)) => {}
        Err(error) => return Err(error.into()),
    }
    let fitted = scan.fitted().ok_or(FinishError::Diverged)?;
    Ok(Found {
        values: fitted.values().collect(),
        residual: fitted.residual(),
        predicted_loss: fitted.predicted_loss(),
    })
}
