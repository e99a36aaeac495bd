//! The readings and the state of the samples, in their slots.

use crate::gonio::Reading;
use crate::model::{COUNTED, Slot};

/// State of a sample: the flags of its slot, and the number of its invalid readings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Status(u32);

impl Status {
    /// Neither read nor skipped, and without an invalid reading.
    pub(super) const PENDING: Self = Self(0);
    /// Skipped. The reading, if any, is discarded.
    pub(super) const SKIP: Self = Self(Self::SKIPPED);
    /// The sample counts in the fit.
    pub(super) const COUNTED: u32 = COUNTED;
    const SKIPPED: u32 = 2;
    pub(super) const READ: u32 = 4;
    pub(super) const SATURATED: u32 = 8;
    /// The driver has not returned the reading for saving.
    pub(super) const UNSAVED: u32 = 16;
    /// One invalid reading. The upper bits count them.
    const INVALID: u32 = 1 << 8;

    pub(super) fn of(slot: &Slot) -> Self {
        let [.., flags] = slot;
        Self(flags.to_bits())
    }

    pub(super) fn put(self, slot: &mut Slot) {
        let [.., flags] = slot;
        *flags = f32::from_bits(self.0);
    }

    pub(super) fn has(self, flag: u32) -> bool {
        self.0 & flag != 0
    }

    pub(super) fn set(&mut self, flag: u32, is_set: bool) {
        self.0 &= !flag;
        self.0 |= if is_set { flag } else { 0 };
    }

    pub(super) fn is_pending(self) -> bool {
        !self.has(Self::READ | Self::SKIPPED)
    }

    /// Returns true if the sample has an unsaturated reading.
    pub(super) fn is_exact(self) -> bool {
        self.has(Self::READ) && !self.has(Self::SATURATED)
    }

    /// Counts an invalid reading. At this limit it returns true, and begins again.
    pub(super) fn count_invalid(&mut self, limit: u8) -> bool {
        self.0 = self.0.saturating_add(Self::INVALID);
        let is_last = self.0 / Self::INVALID >= limit.into();
        if is_last {
            self.0 %= Self::INVALID;
        }
        is_last
    }
}

/// The samples with a flag.
pub(super) fn with_flag(slots: &[Slot], flag: u32) -> impl Iterator<Item = &Slot> + Clone {
    let has_flag = move |slot: &&Slot| Status::of(slot).has(flag);
    slots.iter().filter(has_flag)
}

/// Records a reading, and forgets invalid ones.
pub(super) fn record(slot: &mut Slot, reading: Reading) {
    let [_, _, _, _, _, brdf @ .., _, flags] = slot;
    *brdf = reading.brdf;
    let mut status = Status(Status::READ);
    status.set(Status::SATURATED, reading.saturated);
    *flags = f32::from_bits(status.0);
}

/// The reading of a sample, as recorded.
pub(super) fn reading(slot: &Slot) -> Option<Reading> {
    let status = Status::of(slot);
    status.has(Status::READ).then(|| Reading {
        brdf: measured_brdf(slot),
        saturated: status.has(Status::SATURATED),
    })
}

/// The measured value of a sample, as recorded: the BRDF in linear RGB, sr^-1, not times the cosine.
pub(super) fn measured_brdf(slot: &Slot) -> [f32; 3] {
    let [_, _, _, _, _, measured @ .., _, _] = *slot;
    measured
}

/// Returns true if the fit clamps a channel of a sample's measured value.
pub(super) fn is_clamped(slot: &Slot) -> bool {
    let [.., min, _] = *slot;
    measured_brdf(slot).iter().any(|value| *value < min)
}
