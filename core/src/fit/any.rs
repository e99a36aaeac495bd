//! The model that the recipe names.

use super::algorithm::{Algorithm, Channels};
use super::linear::Linear;
use super::method::FitMethod;
use crate::error::Error;
use crate::geometry::HalfDifference;
use crate::model::linear::Basis;
use crate::model::{CookTorrance, ModelKind, Neural, Phong, Samples};

/// The model that the recipe names. One firmware accepts recipes of all four models at run time, and links the code of
/// all of them.
///
/// ```
/// use glimpse_core::fit::AnyModel;
/// use glimpse_core::recipe::{Recipe, memory_words};
/// use glimpse_core::scan::Scan;
///
/// static RECIPES: [&[u8]; 2] = [
///     include_bytes!("../../examples/recipes/linear-n8.recipe"),
///     include_bytes!("../../examples/recipes/neural-n8.recipe"),
/// ];
/// let mut memory = [0.0; memory_words(&RECIPES)]; // enough for each of them
/// for bytes in RECIPES {
///     let scan = Scan::<AnyModel>::new(Recipe::parse(bytes)?, &mut memory)?;
///     println!("{}", scan.recipe().model());
/// }
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct AnyModel;

/// Calls a function of the recipe's model.
macro_rules! dispatch {
    ($method:ident, $function:ident($($argument:expr),*)) => {
        // Qualified, because `Model` has functions of the same names.
        match $method.model() {
            ModelKind::Phong => <Phong as Algorithm>::$function($($argument),*),
            ModelKind::Neural => <Neural as Algorithm>::$function($($argument),*),
            ModelKind::CookTorrance => <CookTorrance as Algorithm>::$function($($argument),*),
            ModelKind::Linear => <Linear as Algorithm>::$function($($argument),*),
        }
    };
}

// Inlined, so that the models' code is compiled with the firmware, at its optimization level.
impl Algorithm for AnyModel {
    #[inline]
    fn words(method: &FitMethod<'_>, samples: usize) -> Result<usize, Error> {
        dispatch!(method, words(method, samples))
    }

    #[inline]
    fn total(method: &FitMethod<'_>, samples: usize) -> u32 {
        dispatch!(method, total(method, samples))
    }

    #[inline]
    fn start(words: &mut [f32], method: &FitMethod<'_>, channels: Channels) {
        dispatch!(method, start(words, method, channels));
    }

    #[inline]
    fn advance(
        words: &mut [f32],
        method: &FitMethod<'_>,
        samples: Samples<'_>,
        channels: Channels,
        done: u32,
        budget: u32,
    ) -> u32 {
        dispatch!(
            method,
            advance(words, method, samples, channels, done, budget)
        )
    }

    #[inline]
    fn values<'w>(words: &'w [f32], method: &FitMethod<'_>) -> [&'w [f32]; 3] {
        dispatch!(method, values(words, method))
    }

    #[inline]
    fn predicted_loss(words: &[f32], method: &FitMethod<'_>) -> Option<f32> {
        dispatch!(method, predicted_loss(words, method))
    }

    #[inline]
    fn innovation(words: &[f32], method: &FitMethod<'_>) -> Option<f32> {
        dispatch!(method, innovation(words, method))
    }

    #[inline]
    fn at_sample(
        words: &[f32],
        method: &FitMethod<'_>,
        index: usize,
        at: &HalfDifference<f32>,
    ) -> [f32; 3] {
        dispatch!(method, at_sample(words, method, index, at))
    }

    #[inline]
    fn brdf(
        words: &[f32],
        method: &FitMethod<'_>,
        basis: Option<&Basis<'_>>,
        at: &HalfDifference<f32>,
    ) -> Option<[f32; 3]> {
        dispatch!(method, brdf(words, method, basis, at))
    }
}
