//! Core's scan on the host, for any recipe.

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::fit::AnyModel;
use glimpse_core::geometry::Angles;
use glimpse_core::gonio::Reading;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{Residual, Scan};

/// The result of a scan.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanOutcome {
    /// The parameters in the model's order. For Linear, the coefficients of red, then of green, then of blue.
    pub values: Vec<f32>,
    /// The residual of the readings.
    pub residual: Residual,
    /// The prediction of the fit's loss, if the recipe has a loss predictor.
    pub prediction: Option<LossPrediction>,
}

/// The loss that a recipe predicts from readings.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct LossPrediction {
    /// The expected loss.
    pub loss: f32,
    /// The upper bound, which holds for 90 % of materials; None if the recipe has none.
    pub bound: Option<f32>,
    /// True if the readings are unlike those of all training materials; None if the recipe cannot tell.
    pub unlike_training: Option<bool>,
}

/// A function that reads a sample, given its index and its angles in radians. It returns the BRDF in linear RGB, sr^-1
/// (not times the cosine), or None if the reading is missing.
pub type ReadSample<'r> = dyn FnMut(u16, Angles<f32>) -> Option<[f32; 3]> + 'r;

/// Measures at the recipe's directions and fits the model, as the device does. Readings may be missing.
///
/// # Errors
/// Fails for the same reasons as a scan on a device, for example if the recipe requires a reading that is missing.
pub fn scan_with_missing(
    recipe: &Recipe<'_>,
    read: &mut ReadSample<'_>,
) -> Result<ScanOutcome, Error> {
    scan_from(recipe, read, None)
}

/// Runs a [scan](scan_with_missing), with the coefficients of red, green and blue if they are known.
///
/// # Errors
/// As [`scan_with_missing`].
pub fn scan_from(
    recipe: &Recipe<'_>,
    read: &mut ReadSample<'_>,
    coefficients: Option<[&[f32]; 3]>,
) -> Result<ScanOutcome, Error> {
    let mut memory = vec![0.0; recipe.memory_words()];
    let mut scan = Scan::<AnyModel>::new(*recipe, &mut memory)?;
    for (index, angles) in (0..).zip(recipe.pattern()) {
        if let Some(brdf) = read(index, angles) {
            scan.record(index, Reading::new(brdf))?;
        }
    }
    let mut fit = match coefficients {
        Some(coefficients) => scan.fit_from(coefficients)?,
        None => scan.fit()?,
    };
    while !fit.advance(u32::MAX).is_complete() {}
    match fit.finish() {
        // Simulated materials may be perfectly uniform, and callers may want implausible results.
        Err(error) if !error.is_implausible() => return Err(error),
        _ => {}
    }
    let fitted = scan.fitted().ok_or(Error::new(ErrorCode::Diverged))?;
    Ok(ScanOutcome {
        values: fitted.values().collect(),
        residual: fitted.residual(),
        prediction: fitted.predicted_loss().map(|loss| LossPrediction {
            loss,
            bound: fitted.loss_bound(),
            unlike_training: fitted.is_unlike_training(),
        }),
    })
}
