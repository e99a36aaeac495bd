//! What the chip says of itself.

use defmt::Format;

use crate::register::{DBGMCU_IDCODE, RCC_CSR, ROM_TABLE_CIDR0};

/// True in an emulator, which has neither an identity of the chip nor CoreSight's ROM table.
pub fn is_emulated() -> bool {
    DBGMCU_IDCODE.read() == 0 && ROM_TABLE_CIDR0.read() == 0
}

/// Why the chip started anew.
#[derive(Clone, Copy, Format)]
pub enum ResetCause {
    /// The supply came.
    PowerOn,
    /// The supply was too low for a moment.
    BrownOut,
    /// The reset button, or a debug probe.
    Pin,
    /// The firmware itself: after a panic or a fault, such as a stack that overflowed.
    Software,
    /// The watchdog that this firmware starts was not fed: the main loop hung.
    IndependentWatchdog,
    /// The other watchdog, which this firmware does not start.
    WindowWatchdog,
    /// Stop or standby, which are forbidden by the option bytes.
    LowPower,
    /// No cause is recorded. An emulator has none.
    Unknown,
}

impl ResetCause {
    /// Reads what the reset recorded, and clears it for the next one.
    pub fn take() -> Self {
        let flags = RCC_CSR.read();
        RCC_CSR.modify(0, 1 << 24);
        // Every reset pulls the pin too, and a supply that comes was too low before; so those are
        // looked for last.
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
