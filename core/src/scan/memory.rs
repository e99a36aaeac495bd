//! The memory of a scan, which is the caller's: samples, and behind them what the fit works in.
//!
//! The functions are not generic, so that firmware has them once.

use super::FitError;
use super::status::Status;
use crate::geometry::{Directions, HalfDifference};
use crate::model::{SLOT_WORDS, Slot};
use crate::recipe::Recipe;

/// The samples, and the words behind them.
pub(super) fn split(memory: &[f32], samples: usize) -> (&[Slot], &[f32]) {
    let place = samples.saturating_mul(SLOT_WORDS);
    let (slots, words) = memory.split_at_checked(place).unwrap_or_default();
    (slots.as_chunks().0, words)
}

/// The same, to be changed.
pub(super) fn split_mut(memory: &mut [f32], samples: usize) -> (&mut [Slot], &mut [f32]) {
    let place = samples.saturating_mul(SLOT_WORDS);
    let (slots, words) = memory.split_at_mut_checked(place).unwrap_or_default();
    (slots.as_chunks_mut().0, words)
}

/// Puts the directions of a recipe's pattern into the samples, unread.
#[inline(never)]
pub(super) fn lay_out(slots: &mut [Slot], recipe: &Recipe<'_>) {
    for (slot, angles) in slots.iter_mut().zip(recipe.pattern()) {
        let HalfDifference { hx, hz, dx, dy, dz } = HalfDifference::from_angles(angles);
        *slot = [hx, hz, dx, dy, dz, 0.0, 0.0, 0.0, 0.0];
    }
}

/// Where a sample was measured.
pub(super) fn place_of(slot: &Slot) -> HalfDifference<f32> {
    let [hx, hz, dx, dy, dz, ..] = *slot;
    HalfDifference { hx, hz, dx, dy, dz }
}

/// What was measured there: the BRDF in linear RGB, sr^-1, not times the cosine.
pub(super) fn measured_at(slot: &Slot) -> [f32; 3] {
    let [_, _, _, _, _, measured @ .., _] = *slot;
    measured
}

/// Puts what was measured.
pub(super) fn put_measured(slot: &mut Slot, brdf: [f32; 3]) {
    let [_, _, _, _, _, measured @ .., _] = slot;
    *measured = brdf;
}

/// Decides which samples count in a fit, and returns how many: all or none, or, where the recipe tolerates
/// missing readings, those that were read and not saturated. If all were saturated, they count nevertheless.
#[inline(never)]
pub(super) fn weigh(slots: &mut [Slot], recipe: &Recipe<'_>) -> usize {
    let tolerates = recipe.method.tolerates_missing();
    let all = slots.len();
    let (mut read, mut clear) = (0_usize, 0_usize);
    for status in slots
        .iter()
        .map(Status::of)
        .filter(|status| status.is_read())
    {
        read = read.saturating_add(1);
        clear = clear.saturating_add(usize::from(!status.is_saturated()));
    }
    let all_count = !tolerates || clear == 0;
    let counted = match (tolerates, all_count) {
        (false, _) if read < all => 0,
        (_, true) => read,
        (_, false) => clear,
    };
    for slot in slots {
        let status = Status::of(slot);
        let counts = status.is_read() && (all_count || !status.is_saturated());
        status.counted(counts).put(slot);
    }
    counted
}

/// The error of a fit without enough readings.
#[inline(never)]
pub(super) fn incomplete(slots: &[Slot]) -> FitError {
    let mut unread = (0..)
        .zip(slots)
        .filter(|(_, slot)| !Status::of(slot).is_read());
    let first = unread.next().map_or(0, |(index, _)| index);
    let missing = unread.fold(1, |sum: u16, _| sum.saturating_add(1));
    FitError::Incomplete { missing, first }
}

/// The samples that are neither read nor skipped.
pub(super) fn pending(slots: &[Slot]) -> impl Iterator<Item = (u16, Directions<f32>)> {
    (0..)
        .zip(slots)
        .filter(|(_, slot)| Status::of(slot) == Status::PENDING)
        .map(|(index, slot)| (index, place_of(slot).directions()))
}

/// The first of them.
#[inline(never)]
pub(super) fn next_pending(slots: &[Slot]) -> Option<(u16, Directions<f32>)> {
    pending(slots).next()
}
