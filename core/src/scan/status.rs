//! State of each sample of a scan.

use crate::model::{COUNTED, Slot};

/// State of a sample: the flags of its slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Status(u32);

impl Status {
    /// Neither read nor skipped.
    pub(super) const PENDING: Self = Self(0);
    /// Skipped.
    pub(super) const SKIPPED: Self = Self(2);
    const READ: u32 = 4;
    const SATURATED: u32 = 8;
    /// A channel is too far below 0 for the loss.
    const CLAMPED: u32 = 16;
    /// A fit has replaced such values by the smallest that the loss accepts.
    const RAISED: u32 = 32;
    /// Equal to the reading before it in the pattern.
    const REPEATED: u32 = 64;

    /// The status of a sample with a reading.
    pub(super) fn read(saturated: bool, clamped: bool) -> Self {
        Self(Self::READ)
            .with(Self::SATURATED, saturated)
            .with(Self::CLAMPED, clamped)
    }

    pub(super) fn of(slot: &Slot) -> Self {
        let [.., flags] = slot;
        Self(flags.to_bits())
    }

    pub(super) fn put(self, slot: &mut Slot) {
        let [.., flags] = slot;
        *flags = f32::from_bits(self.0);
    }

    fn with(self, flag: u32, is_set: bool) -> Self {
        Self(if is_set {
            self.0 | flag
        } else {
            self.0 & !flag
        })
    }

    pub(super) fn counted(self, counts: bool) -> Self {
        self.with(COUNTED, counts)
    }

    pub(super) fn raised(self) -> Self {
        self.with(Self::RAISED, true)
    }

    pub(super) fn repeated(self, repeats: bool) -> Self {
        self.with(Self::REPEATED, repeats)
    }

    pub(super) fn counts(self) -> bool {
        self.0 & COUNTED != 0
    }

    pub(super) fn is_read(self) -> bool {
        self.0 & Self::READ != 0
    }

    pub(super) fn is_saturated(self) -> bool {
        self.0 & Self::SATURATED != 0
    }

    pub(super) fn is_clamped(self) -> bool {
        self.0 & Self::CLAMPED != 0
    }

    pub(super) fn is_raised(self) -> bool {
        self.0 & Self::RAISED != 0
    }

    pub(super) fn is_repeated(self) -> bool {
        self.0 & Self::REPEATED != 0
    }
}
