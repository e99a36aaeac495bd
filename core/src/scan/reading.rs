//! The record of a scan's readings, and the check of all readings before a fit.

use super::slot::{self, Status, is_clamped, measured_brdf, with_flag};
use crate::error::{Error, ErrorCode};
use crate::fit::Channels;
use crate::gonio::Reading;
use crate::model::Slot;

/// A limit in sr^-1 that no material exceeds at more than three quarters of its readings: thirty times a perfect white.
///
/// A metal may exceed it at half of its readings, in the highlight and towards grazing angles, which learned patterns
/// prefer (for example nickel with Neural's pattern). The lower quartile of every material of MERL and RGL is at most
/// 1.2, with each of the four models' patterns.
const MAX_QUARTILE: f32 = 10.0;
/// The smallest number of samples for this check. Fewer samples may all lie in the highlight.
const MIN_SAMPLES: usize = 4;

/// The result of recording a reading.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Recorded {
    /// True if the reading replaced an earlier one.
    pub replaced: bool,
    /// True if a channel is too far below 0 for the loss. The fit clamps it to the smallest value that the loss
    /// accepts; [`Residual::clamped`](super::Residual::clamped) counts such readings.
    pub clamped: bool,
}

/// Returns the slot of a sample.
pub(super) fn slot_mut(slots: &mut [Slot], index: u16) -> Result<&mut Slot, Error> {
    let error = index_error(index, slots.len());
    slots.get_mut(usize::from(index)).ok_or(error)
}

/// Returns the error of an index that the pattern does not have.
pub(crate) fn index_error(index: u16, samples: usize) -> Error {
    Error::with(ErrorCode::ReadingIndex, [index.into(), samples as u32])
}

/// Records a reading. The function is not inlined, so that its temporaries leave the stack when it returns.
#[inline(never)]
pub(super) fn record(slots: &mut [Slot], index: u16, reading: Reading) -> Result<Recorded, Error> {
    let slot = slot_mut(slots, index)?;
    reading.check(index)?;
    let replaced = Status::of(slot).has(Status::READ);
    slot::record(slot, reading);
    let clamped = is_clamped(slot);
    Ok(Recorded { replaced, clamped })
}

/// Checks the readings of a fit. It rejects readings that are too large for any material, such as raw counts. Returns
/// gray if all readings that count are gray.
#[inline(never)]
pub(super) fn check(slots: &[Slot]) -> Result<Channels, Error> {
    // A sample that does not count may still hold a reading of the previous material.
    let counted = with_flag(slots, Status::COUNTED);
    let values = counted.clone().flat_map(measured_brdf);
    let too_large = values.filter(|value| *value > MAX_QUARTILE).count();
    let is_gray = |slot: &Slot| {
        let [red, green, blue] = measured_brdf(slot).map(f32::to_bits);
        red == green && green == blue
    };
    let gray = counted.clone().all(is_gray);
    let counted = counted.count();
    let all = counted.saturating_mul(3);
    if counted >= MIN_SAMPLES && too_large.saturating_mul(4) > all.saturating_mul(3) {
        return Err(Error::with(
            ErrorCode::ReadingsTooLarge,
            [MAX_QUARTILE as u32, 0],
        ));
    }
    Ok(if gray {
        Channels::Gray
    } else {
        Channels::Color
    })
}
