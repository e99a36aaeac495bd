//! The memory and the stage of a scan. They do not depend on its model, so that firmware contains this code once.

use super::plausibility::Albedo;
use super::residual::{Residual, ResidualSum};
use super::slot::{Status, with_flag};
use crate::error::{Error, ErrorCode};
use crate::fit::Channels;
use crate::geometry::{Directions, HalfDifference};
use crate::model::linear::Basis;
use crate::model::{SLOT_WORDS, Slot, unpack};
use crate::recipe::Recipe;

/// A scan of any model.
pub(super) struct State<'a> {
    pub(super) recipe: Recipe<'a>,
    pub(super) basis: Option<Basis<'a>>,
    /// The samples, then the workspace of the fit.
    pub(super) memory: &'a mut [f32],
    pub(super) stage: Stage,
}

/// Stage of a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stage {
    /// Readings are being recorded. The workspace is unused.
    Reading,
    /// A fit is in progress.
    Fitting(Fitting),
    /// The fit of this number of readings is complete and was checked.
    Fitted { residual: Residual, readings: u16 },
}

/// A fit in progress.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fitting {
    /// Number of completed units of work.
    pub(super) done: u32,
    pub(super) channels: Channels,
    /// Number of readings that count in the fit.
    pub(super) readings: u16,
    pub(super) checks: Checks,
}

/// The checks of a fit, as far as they are done.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Checks {
    /// True if a value or a prediction is not finite.
    pub(super) has_overflowed: bool,
    pub(super) sum: ResidualSum,
    pub(super) albedo: Albedo,
}

/// Splits memory into the samples and the workspace of the fit.
pub(super) fn split<'m>(memory: &'m [f32], recipe: &Recipe<'_>) -> (&'m [Slot], &'m [f32]) {
    let position = recipe.samples().saturating_mul(SLOT_WORDS);
    let (slots, words) = memory.split_at_checked(position).unwrap_or_default();
    (slots.as_chunks().0, words)
}

/// Splits mutable memory into the samples and the workspace of the fit.
pub(super) fn split_mut<'m>(
    memory: &'m mut [f32],
    recipe: &Recipe<'_>,
) -> (&'m mut [Slot], &'m mut [f32]) {
    let position = recipe.samples().saturating_mul(SLOT_WORDS);
    let (slots, words) = memory.split_at_mut_checked(position).unwrap_or_default();
    (slots.as_chunks_mut().0, words)
}

/// Fills the samples with the directions of the pattern and the smallest values that the fit accepts, without readings.
#[inline(never)]
pub(super) fn initialize(memory: &mut [f32], recipe: &Recipe<'_>) {
    let (slots, _) = split_mut(memory, recipe);
    for (slot, angles) in slots.iter_mut().zip(recipe.pattern()) {
        let at = HalfDifference::from_angles(angles);
        let min = recipe.estimator.min_reading(&at);
        let HalfDifference { hx, hz, dx, dy, dz } = at;
        *slot = [hx, hz, dx, dy, dz, 0.0, 0.0, 0.0, min, 0.0];
    }
}

impl State<'_> {
    pub(super) fn slots(&self) -> &[Slot] {
        split(self.memory, &self.recipe).0
    }

    pub(super) fn slots_mut(&mut self) -> &mut [Slot] {
        split_mut(self.memory, &self.recipe).0
    }

    /// Returns true if the readings are the first ones in the recipe's order, all unsaturated, and no sample is skipped.
    #[inline(never)]
    pub(super) fn is_prefix(&self) -> bool {
        let statuses = self.slots().iter().map(Status::of);
        let mut others = statuses.skip_while(|status| status.is_exact());
        others.all(Status::is_pending)
    }

    /// Marks the samples that count in a fit, and returns their number.
    ///
    /// If the recipe needs every reading, all samples count. Otherwise, samples with an unsaturated reading count. If all
    /// readings are saturated, the samples with a reading count.
    #[inline(never)]
    pub(super) fn mark_counted(&mut self) -> Result<u16, Error> {
        let tolerates_missing = self.recipe.estimator.tolerates_missing();
        let slots = self.slots_mut();
        let mut statuses = slots.iter().map(Status::of);
        let uses_saturated = !tolerates_missing || !statuses.any(Status::is_exact);
        for slot in &mut *slots {
            let mut status = Status::of(slot);
            let counts = status.is_exact() || uses_saturated && status.has(Status::READ);
            status.set(Status::COUNTED, counts);
            status.put(slot);
        }
        let counted = with_flag(slots, Status::COUNTED).count();
        if counted > 0 && (tolerates_missing || counted == slots.len()) {
            return Ok(counted as u16); // at most MAX_SAMPLES
        }
        let is_missing = |(_, slot): &(u32, &Slot)| !Status::of(slot).has(Status::READ);
        let mut missing = (0..).zip(&*slots).filter(is_missing);
        let first = missing.next().map_or(0, |(index, _)| index);
        let count = missing.fold(1, |sum: u32, _| sum.saturating_add(1));
        Err(Error::with(ErrorCode::Incomplete, [count, first]))
    }

    /// The samples that are neither read nor skipped.
    pub(super) fn pending(&self) -> impl Iterator<Item = (u16, Directions<f32>)> {
        (0..)
            .zip(self.slots())
            .filter(|(_, slot)| Status::of(slot).is_pending())
            .map(|(index, slot)| (index, unpack(slot, 0.0).at.directions()))
    }

    /// The first pending sample.
    #[inline(never)]
    pub(super) fn next_pending(&self) -> Option<(u16, Directions<f32>)> {
        self.pending().next()
    }
}
