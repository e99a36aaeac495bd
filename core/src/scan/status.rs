//! State of each sample of a scan.

use crate::model::{COUNTED, Slot};

/// State of a sample: the flags of its slot, and the number of its invalid readings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Status(u32);

impl Status {
    /// Neither read nor skipped, and without an invalid reading.
    pub(super) const PENDING: Self = Self(0);
    const SKIPPED: u32 = 2;
    const READ: u32 = 4;
    const SATURATED: u32 = 8;
    /// The driver has not returned the reading for saving.
    const UNSAVED: u32 = 16;
    /// One invalid reading. The upper bits count them.
    const INVALID: u32 = 1 << 8;
    /// The largest count of invalid readings.
    const MAX_INVALID: u32 = 255;

    /// The status of a sample with a valid reading.
    pub(super) fn read(saturated: bool) -> Self {
        Self(Self::READ).with(Self::SATURATED, saturated)
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

    pub(super) fn unsaved(self, is_unsaved: bool) -> Self {
        self.with(Self::UNSAVED, is_unsaved)
    }

    /// The status of a skipped sample. Its reading, if any, is discarded.
    pub(super) const SKIP: Self = Self(Self::SKIPPED);

    /// Counts another invalid reading. Returns the new status and the count.
    pub(super) fn with_invalid_reading(self) -> (Self, u8) {
        let count = (self.0 / Self::INVALID).saturating_add(1);
        let count = count.min(Self::MAX_INVALID);
        let flags = self.0 % Self::INVALID;
        // At most 255 * 256, so this does not overflow.
        let status = Self(flags.saturating_add(count.saturating_mul(Self::INVALID)));
        (status, count as u8)
    }

    /// The status without invalid readings.
    pub(super) fn without_invalid_readings(self) -> Self {
        Self(self.0 % Self::INVALID)
    }

    pub(super) fn counts(self) -> bool {
        self.0 & COUNTED != 0
    }

    pub(super) fn is_read(self) -> bool {
        self.0 & Self::READ != 0
    }

    pub(super) fn is_pending(self) -> bool {
        self.0 & (Self::READ | Self::SKIPPED) == 0
    }

    pub(super) fn is_saturated(self) -> bool {
        self.0 & Self::SATURATED != 0
    }

    pub(super) fn is_unsaved(self) -> bool {
        self.0 & Self::UNSAVED != 0
    }
}
