//! The independent watchdog: resets the chip when the main loop hangs.
//!
//! Only the main loop feeds it, in every iteration. Interrupt handlers must not, because they still run when the main
//! loop hangs.

use crate::register::{DBGMCU_APB1_FZ, IWDG_KR, IWDG_PR, IWDG_RLR};

/// Starts the watchdog. It resets the chip nominally 4.1 s after the last call of [`feed`]: 4096 counts at 32 kHz / 32.
/// The frequency of its oscillator is between 17 and 47 kHz, so call [`feed`] at least every 2.7 s.
pub fn start() {
    DBGMCU_APB1_FZ.modify(0, 1 << 12); // stopped while a debugger halts the core
    IWDG_KR.write(0xCCCC);
    IWDG_KR.write(0x5555);
    IWDG_PR.write(3);
    IWDG_RLR.write(0xFFF);
    feed();
}

/// Restarts the watchdog's timeout.
pub fn feed() {
    IWDG_KR.write(0xAAAA);
}
