//! The memory of a scan, which is the caller's.

use super::status::Status;
use super::{FitError, Residual};
use crate::fit::Fitter;
use crate::geometry::{Directions, HalfDifference};
use crate::model::Sample;
use crate::recipe::Recipe;

/// All memory that scan and fit take: readings, and what the fit works in.
///
/// [`Memory::new`] is a constant, all zeros: in a static it costs no flash. One memory serves one
/// scan after the other, by the same recipe or by another.
///
/// ```
/// use glimpse_core::model::{Neural, Phong};
/// use glimpse_core::recipe::Recipe;
/// use glimpse_core::scan::{Memory, Scan};
///
/// // A firmware makes it a static: by `static_cell::ConstStaticCell`, `cortex_m::singleton!`, ..
/// let mut memory = Memory::<Neural, 8>::new();
/// let recipe = Recipe::parse(include_bytes!("../../examples/recipes/neural-n8.recipe"))?;
///
/// let scan = Scan::new(recipe, &mut memory)?;
/// let memory = scan.into_memory(); // for the next material, or the next recipe
/// let scan = Scan::new(recipe, memory)?;
///
/// // How much it takes is known when the firmware is built.
/// const { assert!(size_of::<Memory<Neural, 8>>() < 5_900 && size_of::<Memory<Phong, 8>>() < 2_300) };
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
pub struct Memory<K: Fitter, const CAPACITY: usize> {
    pub(super) samples: [Sample<f32>; CAPACITY],
    pub(super) status: [Status; CAPACITY],
    pub(super) stage: Stage,
    pub(super) workspace: K::Workspace,
}

impl<K: Fitter, const CAPACITY: usize> Memory<K, CAPACITY> {
    /// Nothing was read yet.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            samples: [Sample::ZERO; CAPACITY],
            status: [Status::PENDING; CAPACITY],
            stage: Stage::Reading,
            workspace: K::EMPTY,
        }
    }
}

impl<K: Fitter, const CAPACITY: usize> Default for Memory<K, CAPACITY> {
    fn default() -> Self {
        Self::new()
    }
}

/// What is going on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stage {
    /// Readings are taken; what the workspace holds means nothing.
    Reading,
    /// So many units of a fit are done.
    Fitting { done: u32 },
    /// The fit is done and was looked at.
    Fitted(Residual),
}

// What does not depend on the model is not generic, so that it is there once, and small.

/// Puts the samples of a recipe's pattern where they belong, unread.
#[inline(never)]
pub(super) fn lay_out(samples: &mut [Sample<f32>], recipe: &Recipe<'_>) {
    let weight = 1.0 / (3.0 * recipe.samples() as f32);
    for (sample, angles) in samples.iter_mut().zip(recipe.pattern()) {
        sample.at = HalfDifference::from_angles(angles);
        sample.measured = [0.0; 3];
        sample.weight = weight;
    }
}

/// Gives each sample its weight in a fit, and returns how many count: all of them or none, or, where the
/// recipe can do without some, those that were read and not saturated. If all were saturated, they
/// count nevertheless.
#[inline(never)]
pub(super) fn weigh(samples: &mut [Sample<f32>], status: &[Status], recipe: &Recipe<'_>) -> usize {
    let all = recipe.samples();
    let takes_missing = recipe.method().takes_missing();
    let known = status.iter().take(all);
    let read = known.clone().filter(|status| status.is_read());
    let clear = read.clone().filter(|status| !status.is_saturated()).count();
    let read = read.count();
    let all_count = !takes_missing || clear == 0;
    let counted = match (takes_missing, all_count) {
        (false, _) if read < all => 0,
        (_, true) => read,
        (_, false) => clear,
    };
    let weight = 1.0 / (3.0 * counted.max(1) as f32);
    for (sample, status) in samples.iter_mut().zip(known) {
        let counts = status.is_read() && (all_count || !status.is_saturated());
        sample.weight = if counts { weight } else { 0.0 };
    }
    counted
}

/// The error of a fit without enough readings.
#[inline(never)]
pub(super) fn incomplete(status: &[Status], recipe: &Recipe<'_>) -> FitError {
    let status = (0..).zip(status).take(recipe.samples());
    let mut unread = status.filter(|(_, status)| !status.is_read());
    let first = unread.next().map_or(0, |(index, _)| index);
    let missing = unread.fold(1, |sum: u16, _| sum.saturating_add(1));
    FitError::Incomplete { missing, first }
}

/// The samples that are not read yet.
pub(super) fn pending(
    samples: &[Sample<f32>],
    status: &[Status],
    recipe: &Recipe<'_>,
) -> impl Iterator<Item = (u16, Directions<f32>)> {
    let samples = (0..).zip(samples.iter().zip(status));
    samples
        .take(recipe.samples())
        .filter(|(_, (_, status))| **status == Status::PENDING)
        .map(|(index, (sample, _))| (index, sample.at.directions()))
}

/// The first of them.
#[inline(never)]
pub(super) fn next_pending(
    samples: &[Sample<f32>],
    status: &[Status],
    recipe: &Recipe<'_>,
) -> Option<(u16, Directions<f32>)> {
    pending(samples, status, recipe).next()
}
