//! Clocks: 168 MHz from the PLL on the internal oscillator, or 16 MHz if the PLL does not lock.
//!
//! The internal oscillator is accurate to 1 % at room temperature, which is enough for a UART. No crystal is needed.

use crate::chip;
use crate::register::{FLASH_ACR, RCC_CFGR, RCC_CR, RCC_PLLCFGR, Register};

/// Number of polls before the PLL counts as failed. They take at least 25 ms; the PLL locks within 0.3 ms.
const MAX_POLLS: u32 = 100_000;

/// Clock source of the core and its peripherals.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Clocks {
    /// The PLL, in normal operation.
    Pll,
    /// The internal oscillator, ten times slower, because the PLL did not lock. Time and baud rate are still correct.
    Oscillator,
    /// QEMU, which does not model the clocks. Its timers count nanoseconds.
    Emulator,
}

impl Clocks {
    /// Configures the clocks.
    pub fn start() -> Self {
        FLASH_ACR.write(0b111 << 8 | 5); // both caches, prefetch, five wait states
        // 16 MHz / 8 * 168 / 2 = 168 MHz. The rest of the register is reserved.
        RCC_PLLCFGR.modify(0x0F43_7FFF, 7 << 24 | 168 << 6 | 8);
        RCC_CR.modify(0, 1 << 24);
        if !poll_until(|| RCC_CR.read() & 1 << 25 != 0) {
            return if chip::is_emulated() {
                Self::Emulator
            } else {
                Self::Oscillator
            };
        }
        RCC_CFGR.write(0b100 << 13 | 0b101 << 10); // APB2 / 2, APB1 / 4
        RCC_CFGR.modify(0b11, 0b10); // switches the core to the PLL
        if poll_until(|| RCC_CFGR.read() & 0b1100 == 0b1000) {
            return Self::Pll;
        }
        RCC_CFGR.write(0); // reset value: no division
        Self::Oscillator
    }

    /// Clock of the core, Hz.
    pub const fn core_hz(self) -> u32 {
        match self {
            Self::Pll | Self::Emulator => 168_000_000,
            Self::Oscillator => 16_000_000,
        }
    }

    /// Clock of the peripherals on APB1, Hz.
    pub const fn apb1_hz(self) -> u32 {
        match self {
            Self::Pll | Self::Emulator => 42_000_000,
            Self::Oscillator => 16_000_000,
        }
    }

    /// Clock of the peripherals on APB2, Hz.
    pub const fn apb2_hz(self) -> u32 {
        match self {
            Self::Pll | Self::Emulator => 84_000_000,
            Self::Oscillator => 16_000_000,
        }
    }

    /// Clock of the timers on APB1, Hz. It is twice the bus clock if the bus clock is divided.
    pub const fn timer_hz(self) -> u32 {
        match self {
            Self::Pll => 84_000_000,
            Self::Oscillator => 16_000_000,
            Self::Emulator => 1_000_000_000,
        }
    }

    /// Logs the clocks.
    pub fn report(self) {
        match self {
            Self::Pll => defmt::info!("clock: 168 MHz"),
            Self::Oscillator => defmt::error!("clock: the PLL does not lock; 16 MHz"),
            Self::Emulator => defmt::info!("clock: emulator"),
        }
    }
}

/// Enables the clock of a peripheral. `register` is an enable register of the RCC, and `bit` is the peripheral's mask
/// in it.
pub fn enable_clock(register: Register, bit: u32) {
    register.modify(0, bit);
    register.read(); // delay until the clock runs, required by the errata sheet
}

/// Polls a condition until it holds. Returns false after [`MAX_POLLS`] polls.
fn poll_until(is_ready: impl Fn() -> bool) -> bool {
    (0..MAX_POLLS).any(|_| is_ready())
}
