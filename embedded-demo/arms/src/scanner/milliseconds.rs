//! Microseconds to milliseconds, without losing any.

/// Microseconds that make no millisecond yet.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Milliseconds {
    rest: u32,
}

impl Milliseconds {
    /// Milliseconds that have passed since the last call, if so many microseconds have.
    pub(super) fn of(&mut self, elapsed: u32) -> u32 {
        let microseconds = self.rest.saturating_add(elapsed);
        self.rest = microseconds % 1000;
        microseconds / 1000
    }
}
