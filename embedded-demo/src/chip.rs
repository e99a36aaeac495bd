//! Identification of the chip and its reset cause.

use defmt::Format;

use crate::register::{DBGMCU_IDCODE, RCC_CSR, ROM_TABLE_CIDR0};

/// Returns true in an emulator, which has neither a chip identity nor CoreSight's ROM table.
pub fn is_emulated() -> bool {
    DBGMCU_IDCODE.read() == 0 && ROM_TABLE_CIDR0.read() == 0
}

/// Cause of a reset.
#[derive(Clone, Copy, Format)]
pub enum ResetCause {
    /// The supply was turned on.
    PowerOn,
    /// The supply voltage dropped for a moment.
    BrownOut,
    /// The reset button, or a debug probe.
    Pin,
    /// The firmware itself, after a panic or a fault such as a stack overflow.
    Software,
    /// The independent watchdog: the main loop hung and did not feed it.
    IndependentWatchdog,
    /// The window watchdog, which this firmware does not start.
    WindowWatchdog,
    /// Stop or standby mode, although the option bytes forbid it.
    LowPower,
    /// No recorded cause, as in an emulator.
    Unknown,
}

impl ResetCause {
    /// Reads the recorded cause, and clears it for the next reset.
    pub fn take() -> Self {
        let flags = RCC_CSR.read();
        RCC_CSR.modify(0, 1 << 24);
        // Every reset sets the pin's flag, and power-on also sets the brown-out flag. Check these last.
        [
            (31, Self::LowPower),
            (30, Self::WindowWatchdog),
            (29, Self::IndependentWatchdog),
            (28, Self::Software),
            (27, Self::PowerOn),
            (25, Self::BrownOut),
            (26, Self::Pin),
        ]
        .into_iter()
        .find(|(bit, _)| flags & 1 << bit != 0)
        .map_or(Self::Unknown, |(_, cause)| cause)
    }
}
