//! A scan on the host: core's own, by any recipe.

use glimpse_core::fit::{AnyModel, linear_words};
use glimpse_core::geometry::Angles;
use glimpse_core::recipe::{MAX_COMPONENTS, MAX_SAMPLES, Recipe};
use glimpse_core::scan::{Memory, Reading, Residual, Scan};

use super::JudgeError;

/// What a scan has found.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// A model's parameters in its order, or Linear's coefficients, m for red, m for green, m for
    /// blue.
    pub values: Vec<f32>,
    /// How well they explain the readings.
    pub residual: Residual,
}

/// Reads where the recipe says, angles in radians, and fits, as the device does: `read` gives the
/// BRDF in linear RGB, sr^-1, not times the cosine.
///
/// # Errors
/// [`JudgeError::Reading`], [`JudgeError::Fit`] or [`JudgeError::Finish`] where a device would give
/// up.
pub fn scan(
    recipe: &Recipe<'_>,
    read: impl FnMut(Angles<f32>) -> [f32; 3],
) -> Result<Found, JudgeError> {
    // A memory has its size at compile time: one that serves nearly all, and one that serves all.
    const WORDS: usize = linear_words(256, 64);
    const ALL_WORDS: usize = linear_words(MAX_SAMPLES, MAX_COMPONENTS);
    let components = recipe.ridge().map_or(0, |ridge| ridge.components());
    if recipe.samples() <= 256 && components <= 64 {
        scan_in::<WORDS, 256>(recipe, read)
    } else {
        scan_in::<ALL_WORDS, MAX_SAMPLES>(recipe, read)
    }
}

fn scan_in<const WORDS: usize, const CAPACITY: usize>(
    recipe: &Recipe<'_>,
    mut read: impl FnMut(Angles<f32>) -> [f32; 3],
) -> Result<Found, JudgeError> {
    let mut memory = Box::new(Memory::<AnyModel<WORDS>, CAPACITY>::new());
    let mut scan = Scan::new(*recipe, &mut *memory)?;
    for (index, angles) in (0..).zip(recipe.pattern()) {
        scan.record(index, Reading::new(read(angles)))?;
    }
    let mut fit = scan.fit()?;
    while !fit.advance(u32::MAX).is_complete() {}
    let fitted = fit.finish()?;
    Ok(Found {
        values: fitted.values().collect(),
        residual: fitted.residual(),
    })
}
