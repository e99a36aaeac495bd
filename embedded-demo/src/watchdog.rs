//! The independent watchdog: resets the chip when the main loop hangs.
//!
//! Only the main loop feeds it, at every turn. No interrupt handler may, because interrupts go on
//! when the main loop does not.

use crate::register::{DBGMCU_APB1_FZ, IWDG_KR, IWDG_PR, IWDG_RLR};

/// Resets the chip unless [`feed`] is called in time: nominally every 4.1 s (32 kHz / 32 / 4096);
/// its oscillator may have from 17 to 47 kHz, so at least every 2.7 s.
pub fn start() {
    DBGMCU_APB1_FZ.modify(0, 1 << 12); // not while a debugger halts the core
    IWDG_KR.write(0xCCCC);
    IWDG_KR.write(0x5555);
    IWDG_PR.write(3);
    IWDG_RLR.write(0xFFF);
    feed();
}

/// The main loop is alive.
pub fn feed() {
    IWDG_KR.write(0xAAAA);
}
