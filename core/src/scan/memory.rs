//! The layout of a scan's memory: the samples, then the workspace of the fit.
//!
//! The functions are not generic, so that firmware contains them once.

use super::status::Status;
use crate::error::{Error, ErrorCode};
use crate::geometry::{Directions, HalfDifference};
use crate::model::{SLOT_WORDS, Slot};
use crate::recipe::Recipe;

/// Splits memory into the samples and the workspace.
pub(super) fn split(memory: &[f32], samples: usize) -> (&[Slot], &[f32]) {
    let position = samples.saturating_mul(SLOT_WORDS);
    let (slots, words) = memory.split_at_checked(position).unwrap_or_default();
    (slots.as_chunks().0, words)
}

/// Splits mutable memory into the samples and the workspace.
pub(super) fn split_mut(memory: &mut [f32], samples: usize) -> (&mut [Slot], &mut [f32]) {
    let position = samples.saturating_mul(SLOT_WORDS);
    let (slots, words) = memory.split_at_mut_checked(position).unwrap_or_default();
    (slots.as_chunks_mut().0, words)
}

/// Fills the samples with the directions of a recipe's pattern and the smallest values that its fit accepts, without
/// readings.
#[inline(never)]
pub(super) fn initialize(slots: &mut [Slot], recipe: &Recipe<'_>) {
    for (slot, angles) in slots.iter_mut().zip(recipe.pattern()) {
        let at = HalfDifference::from_angles(angles);
        let min = recipe.estimator.min_reading(&at);
        let HalfDifference { hx, hz, dx, dy, dz } = at;
        *slot = [hx, hz, dx, dy, dz, 0.0, 0.0, 0.0, min, 0.0];
    }
}

/// The half and difference vectors of a sample.
pub(super) fn half_difference_of(slot: &Slot) -> HalfDifference<f32> {
    let [hx, hz, dx, dy, dz, ..] = *slot;
    HalfDifference { hx, hz, dx, dy, dz }
}

/// The measured value of a sample, as recorded: the BRDF in linear RGB, sr^-1, not times the cosine.
pub(super) fn measured_brdf(slot: &Slot) -> [f32; 3] {
    let [_, _, _, _, _, measured @ .., _, _] = *slot;
    measured
}

/// Sets the measured value of a sample.
pub(super) fn set_measured_brdf(slot: &mut Slot, brdf: [f32; 3]) {
    let [_, _, _, _, _, measured @ .., _, _] = slot;
    *measured = brdf;
}

/// Returns true if the fit clamps a channel of a sample's measured value.
pub(super) fn is_clamped(slot: &Slot) -> bool {
    let [.., min, _] = *slot;
    measured_brdf(slot).iter().any(|value| *value < min)
}

/// Returns true if the readings are the first ones in the recipe's order, all unsaturated, and no sample is skipped.
#[inline(never)]
pub(super) fn is_prefix(slots: &[Slot]) -> bool {
    let mut statuses = slots
        .iter()
        .map(Status::of)
        .skip_while(|status| status.is_read() && !status.is_saturated());
    statuses.all(Status::is_pending)
}

/// Marks the samples that count in a fit, and returns their number.
///
/// If the recipe needs every reading, all samples count, or none if a reading is missing. Otherwise, samples with an
/// unsaturated reading count. If all readings are saturated, the samples with a reading count.
#[inline(never)]
pub(super) fn mark_counted(slots: &mut [Slot], recipe: &Recipe<'_>) -> usize {
    let tolerates_missing = recipe.estimator.tolerates_missing();
    let (mut read, mut unsaturated) = (0_usize, 0_usize);
    for status in slots
        .iter()
        .map(Status::of)
        .filter(|status| status.is_read())
    {
        read = read.saturating_add(1);
        unsaturated = unsaturated.saturating_add(usize::from(!status.is_saturated()));
    }
    let count_saturated = !tolerates_missing || unsaturated == 0;
    let counted = match (tolerates_missing, count_saturated) {
        (false, _) if read < slots.len() => 0,
        (_, true) => read,
        (_, false) => unsaturated,
    };
    for slot in slots {
        let status = Status::of(slot);
        let counts = status.is_read() && (count_saturated || !status.is_saturated());
        status.counted(counts).put(slot);
    }
    counted
}

/// The error of a fit without enough readings.
#[inline(never)]
pub(super) fn incomplete(slots: &[Slot]) -> Error {
    let mut unread = (0..)
        .zip(slots)
        .filter(|(_, slot)| !Status::of(slot).is_read());
    let first = unread.next().map_or(0, |(index, _)| index);
    let missing = unread.fold(1, |sum: u16, _| sum.saturating_add(1));
    Error::with(ErrorCode::Incomplete, [missing.into(), first])
}

/// The samples that are neither read nor skipped.
pub(super) fn pending(slots: &[Slot]) -> impl Iterator<Item = (u16, Directions<f32>)> {
    (0..)
        .zip(slots)
        .filter(|(_, slot)| Status::of(slot).is_pending())
        .map(|(index, slot)| (index, half_difference_of(slot).directions()))
}

/// The first pending sample.
#[inline(never)]
pub(super) fn next_pending(slots: &[Slot]) -> Option<(u16, Directions<f32>)> {
    pending(slots).next()
}
