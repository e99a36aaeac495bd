//! The clock of one scan.

/// A monotonic clock that starts at 0 with each driver.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Clock {
    now_us: u64,
}

impl Clock {
    /// Advances the clock by `elapsed_us` and returns the time in ms.
    pub(super) fn advance(&mut self, elapsed_us: u32) -> u64 {
        self.now_us = self.now_us.saturating_add(elapsed_us.into());
        self.now_us / 1000
    }
}
