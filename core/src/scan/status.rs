//! State of each sample of a scan.

/// State of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Status(u8);

impl Status {
    /// Neither read nor skipped.
    pub(super) const PENDING: Self = Self(0);
    /// Cannot be read.
    pub(super) const SKIPPED: Self = Self(8);
    const READ: u8 = 1;
    const SATURATED: u8 = 2;
    const CLAMPED: u8 = 4;

    /// The status of a sample with a reading.
    pub(super) fn read(saturated: bool, clamped: bool) -> Self {
        let saturated = if saturated { Self::SATURATED } else { 0 };
        let clamped = if clamped { Self::CLAMPED } else { 0 };
        Self(Self::READ | saturated | clamped)
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
}
