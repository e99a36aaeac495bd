//! The pause before the next attempt, which doubles with each failure.

/// The first pause in ms.
const MIN_MS: u32 = 500;
/// The longest pause in ms.
const MAX_MS: u32 = 30_000;

/// A pause before the next attempt.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pause {
    /// Length in ms; 0 without a failure since the last success.
    length_ms: u32,
    /// Its end in ms, once it has begun.
    until: Option<u64>,
}

impl Pause {
    /// Makes the next pause twice as long, after a failure.
    pub(super) fn lengthen(&mut self) {
        self.length_ms = self.length_ms.saturating_mul(2).clamp(MIN_MS, MAX_MS);
        self.until = None;
    }

    /// Begins the pause, unless it has begun.
    pub(super) fn begin(&mut self, now: u64) {
        let until = now.saturating_add(self.length_ms.into());
        self.until.get_or_insert(until);
    }

    /// Returns true if there was a failure since the last success.
    pub(super) fn has_failed(&self) -> bool {
        self.length_ms > 0
    }

    /// The end of the pause in ms; None if it is over.
    pub(super) fn end(&self, now: u64) -> Option<u64> {
        self.until.filter(|until| now < *until)
    }

    /// Forgets all failures, after a success.
    pub(super) fn reset(&mut self) {
        *self = Self::default();
    }
}
