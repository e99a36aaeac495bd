//! A scan on the host: core's own, by any recipe.

use glimpse_core::fit::{Fitter, FitterError, Linear, linear_words};
use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear::Basis;
use glimpse_core::model::{CookTorrance, ModelKind, Neural, Phong, Sample};
use glimpse_core::recipe::{FitMethod, MAX_COMPONENTS, MAX_SAMPLES, Recipe};
use glimpse_core::scan::{
    FinishError, FitError, Memory, Reading, ReadingError, Residual, Scan, ScanError,
};

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
    match recipe.model() {
        ModelKind::Phong => scan_by::<Phong>(recipe, read),
        ModelKind::Neural => scan_by::<Neural>(recipe, read),
        ModelKind::CookTorrance => scan_by::<CookTorrance>(recipe, read),
        // Linear; it refuses a recipe of any other model.
        _ => scan_by::<LinearOnHeap>(recipe, read),
    }
}

fn scan_by<K: Fitter>(recipe: &Recipe<'_>, read: &mut Read<'_>) -> Result<Found, HostScanError> {
    let mut memory = Box::new(Memory::<K, MAX_SAMPLES>::new());
    let mut scan = Scan::new(*recipe, &mut *memory)?;
    for (index, angles) in (0..).zip(recipe.pattern()) {
        if let Some(brdf) = read(index, angles) {
            scan.record(index, Reading::new(brdf))?;
        }
    }
    let mut fit = scan.fit()?;
    while !fit.advance(u32::MAX).is_complete() {}
    let fitted = fit.finish()?;
    Ok(Found {
        values: fitted.values().collect(),
        residual: fitted.residual(),
        predicted_loss: fitted.predicted_loss(),
    })
}

/// Core's Linear with room for the largest recipe. Those 2.4 MB would be too much for a thread's
/// stack, on which a memory is made, so they are taken from the heap when a fit begins.
struct LinearOnHeap;

const WORDS: usize = linear_words(MAX_SAMPLES, MAX_COMPONENTS);

/// None before the fit has begun.
type Words = Option<Box<[f32; WORDS]>>;

impl Fitter for LinearOnHeap {
    type Workspace = Words;
    const EMPTY: Words = None;

    fn accept(learner: &FitMethod<'_>, samples: usize) -> Result<(), FitterError> {
        Linear::<WORDS>::accept(learner, samples)
    }

    fn total(learner: &FitMethod<'_>, samples: usize) -> u32 {
        Linear::<WORDS>::total(learner, samples)
    }

    fn start(words: &mut Words, learner: &FitMethod<'_>) {
        *words = vec![0.0; WORDS].into_boxed_slice().try_into().ok();
        if let Some(words) = words {
            Linear::<WORDS>::start(words, learner);
        }
    }

    fn advance(
        words: &mut Words,
        learner: &FitMethod<'_>,
        samples: &[Sample<f32>],
        done: u32,
        budget: u32,
    ) -> u32 {
        words.as_mut().map_or(done, |words| {
            Linear::<WORDS>::advance(words, learner, samples, done, budget)
        })
    }

    fn values<'w>(words: &'w Words, learner: FitMethod<'w>) -> impl Iterator<Item = f32> + 'w {
        words
            .iter()
            .flat_map(move |words| Linear::<WORDS>::values(words, learner))
    }

    fn is_finite(words: &Words, learner: &FitMethod<'_>) -> bool {
        words
            .as_ref()
            .is_some_and(|words| Linear::<WORDS>::is_finite(words, learner))
    }

    fn predicted_loss(words: &Words, learner: &FitMethod<'_>) -> Option<f32> {
        Linear::<WORDS>::predicted_loss(words.as_ref()?, learner)
    }

    fn at_sample(
        words: &Words,
        learner: &FitMethod<'_>,
        index: usize,
        at: &HalfDifference<f32>,
    ) -> [f32; 3] {
        words.as_ref().map_or([0.0; 3], |words| {
            Linear::<WORDS>::at_sample(words, learner, index, at)
        })
    }

    fn brdf(
        words: &Words,
        learner: &FitMethod<'_>,
        basis: Option<&Basis<'_>>,
        at: &HalfDifference<f32>,
    ) -> Option<[f32; 3]> {
        Linear::<WORDS>::brdf(words.as_ref()?, learner, basis, at)
    }
}
