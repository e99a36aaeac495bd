//! The time of one scan.

/// A monotonic clock that starts at 0 with each driver.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Clock {
    microseconds: u64,
}

impl Clock {
    /// Advances by `elapsed` microseconds and returns the time in ms.
    pub(super) fn advance(&mut self, elapsed: u32) -> u64 {
        self.microseconds = self.microseconds.saturating_add(elapsed.into());
        self.microseconds / 1000
    }
}
